// ffmpeg and ffprobe at work on a file that anybody may have made: programs of their own, which weft-video
// confines to that file.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/ground/process/spawned_program.h"

namespace weft {

// What a program said before it ended.
struct VideoProgramOutput {
  std::string out, errors;
  int wait_status = 0;
};

// One run of "ffmpeg" or "ffprobe". Destroyed before Finish: it is killed. Thread safety: none.
class VideoProgram {
 public:
  // Where its standard output goes: read by us as it comes (kPipe), or kept until its end (kKept).
  enum class Out { kPipe, kKept };

  // `file`: an absolute path without links. The arguments name it "file:<path>". FailedPrecondition:
  // weft-video is not installed beside this program. ResourceExhausted: it cannot be started.
  static absl::StatusOr<VideoProgram> Start(const std::string& program, const std::string& file,
                                            const std::vector<std::string>& arguments, Out out);
  // From its standard output (kPipe), as much as is asked for. OutOfRange: it ends before. DeadlineExceeded:
  // nothing came for a minute.
  absl::Status Read(void* bytes, size_t size);
  // Waits for it and returns what it said; standard output where it was kept, and what it wrote to
  // descriptor 3 where it was not. `grown` is called with the size of the output a few times a second.
  // DeadlineExceeded: it said nothing for two minutes, and was killed. Cancelled: `grown` answered false.
  absl::StatusOr<VideoProgramOutput> Finish(const std::function<bool(size_t bytes)>& grown = nullptr);

 private:
  VideoProgram() = default;

  SpawnedProgram program_;
  UniqueFd pipe_, kept_, errors_;
};

// Runs "ffmpeg" or "ffprobe" on the file to its end. Errors of VideoProgram; they name the file.
absl::StatusOr<VideoProgramOutput> RunVideoProgram(const std::string& program, const std::string& file,
                                                   const std::vector<std::string>& arguments,
                                                   const std::function<bool(size_t bytes)>& grown = nullptr);

// The last line that is not empty, without the names, addresses and levels that ffmpeg puts in brackets
// before it.
std::string LastComplaint(const std::string& errors);

}  // namespace weft
