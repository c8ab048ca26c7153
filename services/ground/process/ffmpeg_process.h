// The program ffmpeg at the other end of a pipe. It is a program of its own, not a library: builds of it are
// under the GPL.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/ground/process/spawned_program.h"

namespace weft {

// Frames a second as ffmpeg takes them: a fraction, or 30 where no period is known (0).
std::string VideoRate(int64_t period_ns);

// A file as an argument, whatever its name: ffmpeg would take a dash for an option and a colon for a
// protocol.
std::string FileArgument(const std::string& path);

// Destroyed before Finish: the program is killed. Thread safety: none.
class FfmpegProcess {
 public:
  // `arguments` after "ffmpeg -hide_banner -loglevel error -nostdin -y". NotFound: no such program.
  static absl::StatusOr<FfmpegProcess> Start(const std::vector<std::string>& arguments);
  // To its standard input. Internal: it has ended; the message holds its last words.
  absl::Status Write(const void* bytes, size_t size);
  // From its standard output, as much as is asked for. OutOfRange: it ends before.
  absl::Status Read(void* bytes, size_t size);
  // Closes its input and waits for it. Internal where it failed, with its last words.
  absl::Status Finish();

 private:
  FfmpegProcess() = default;
  std::string LastWords() const;

  SpawnedProgram program_;
  UniqueFd pipe_;    // both ways
  UniqueFd errors_;  // what it says on standard error
};

}  // namespace weft
