// Files of others are read in a process of their own, with limits of memory and time.
#pragma once

#include <chrono>
#include <cstdint>
#include <semaphore>
#include <string>

#include "absl/status/statusor.h"
#include "services/server/daemon/program/daemon.h"
#include "weft/v1/reading.pb.h"

namespace weft {

struct ReaderOptions {
  std::string program;      // weft-worker
  std::string worker_user;  // empty: the daemon's
  int64_t memory_mib = 2048;
  std::chrono::seconds patience{600};
};

// Thread safety: any thread. A few readings run at once, the others wait: callers have fewer places than that
// for jobs (KnownInputs) and items (Uploads), so that some stay for the daemon's own.
class ReaderProcess {
 public:
  explicit ReaderProcess(ReaderOptions options) : options_(std::move(options)) {}

  // Errors of the reading. InvalidArgument: what was read ended its reader. ResourceExhausted: it takes more
  // memory than a reader has, or no process can be started. DeadlineExceeded.
  absl::StatusOr<v1::ReadingAnswer> Run(const v1::Reading& reading);

 private:
  static constexpr int kAtOnce = 8;
  const ReaderOptions options_;
  std::counting_semaphore<kAtOnce> free_{kAtOnce};
};

// Has the functions of `options` that read files of clients (load_inputs, find_incomplete, endings,
// check_item) run by reader processes.
void ReadInProcesses(DaemonOptions& options);

}  // namespace weft
