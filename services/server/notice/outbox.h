// Notices on their way: on the disk until they are delivered.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/mutex.h"

namespace weft {

// Delivers the notice in the file `path`. An error that is Unavailable is tried again, another one is not.
// Cancelled: `stop` was requested.
using Deliver = std::function<absl::Status(const std::string& path, const std::stop_token& stop)>;

struct OutboxOptions {
  std::string folder;
  int at_once = 1;                                                                      // deliveries
  std::chrono::milliseconds first_pause{1000}, longest_pause{std::chrono::minutes(5)};  // between tries
};

// Thread safety: any thread.
class Outbox {
 public:
  // Takes up what an earlier one did not deliver. Errors of CreateFolders.
  static absl::StatusOr<std::unique_ptr<Outbox>> Open(OutboxOptions options, Deliver deliver);
  // Stops deliveries; they begin anew with the next one on the folder.
  ~Outbox();

  // The notice is delivered at least once from here on, also when this process is killed. A second one of
  // its name, while the first waits, changes nothing. Errors of WriteFileAtomically.
  absl::Status Put(const std::string& name, const std::string& body);

  struct Waits {
    std::string name;
    int64_t since_unix_ns = 0;
  };
  std::vector<Waits> Waiting();
  // Delivers it no more. FailedPrecondition: it was delivered, or is being delivered.
  absl::Status GiveUp(const std::string& name);

 private:
  using Clock = std::chrono::steady_clock;
  struct Notice {
    Clock::time_point next;
    int64_t since_unix_ns = 0;
    std::chrono::milliseconds pause{0};
    bool busy = false;
  };

  Outbox(OutboxOptions options, Deliver deliver);
  void Load();
  void Work(const std::stop_token& stop);
  void Conclude(const std::string& name, const absl::Status& status) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  std::string PathOf(const std::string& name) const { return options_.folder + "/" + name; }

  const OutboxOptions options_;
  const Deliver deliver_;
  Mutex mutex_;
  std::condition_variable_any changed_;
  std::map<std::string, Notice> waiting_ ABSL_GUARDED_BY(mutex_);  // by name
  std::vector<std::jthread> workers_;
};

}  // namespace weft
