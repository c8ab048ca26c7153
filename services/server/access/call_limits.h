// How much one caller may ask for, so that the others are served.
#pragma once

#include <array>
#include <chrono>
#include <deque>
#include <functional>
#include <map>
#include <string>

#include "absl/status/status.h"
#include "base/mutex.h"
#include "services/server/access/methods.h"

namespace weft {

struct CallerLimits {
  double calls_per_s = 500;  // in the mean
  double burst = 1000;       // calls
  // Calls that run at once.
  int unary = 24;
  int streams = 300;
  int uploads = 8;
  int jobs = 300;  // unfinished; the job queue counts them
  // Of all callers together, so many of them for operators: threads, and what the daemon keeps for streams.
  // Uploads are counted where they are received.
  int all_unary = 336, reserved_unary = 16;
  int all_streams = 4096, reserved_streams = 256;

  int Of(CallKind kind) const {
    return kind == CallKind::kUnary ? unary : kind == CallKind::kStream ? streams : uploads;
  }
};

// Counts the calls of every caller, by name. Thread safety: any thread.
class CallLimits {
 public:
  using Time = std::chrono::steady_clock::time_point;
  using Clock = std::function<Time()>;

  explicit CallLimits(CallerLimits limits, Clock clock = std::chrono::steady_clock::now);

  // Counts a call that arrives, by a caller of this role. ResourceExhausted says when to come again
  // (retry_after.h); such a call is not counted among those that run.
  absl::Status Admit(const std::string& caller, CallKind kind, v1::Role role = v1::ROLE_CLIENT);
  // Counts one that is refused for another reason. ResourceExhausted as Admit, for too many in a second.
  absl::Status Charge(const std::string& caller);
  // An admitted call runs, and has ended. One that never begins, since its client went away, is forgotten
  // after some seconds.
  void Begin(const std::string& caller, CallKind kind);
  void End(const std::string& caller, CallKind kind);

  // Of all callers.
  int Running(CallKind kind);

 private:
  struct Calls {
    std::deque<Time> admitted;  // and not begun
    int running = 0;
  };
  struct Account {
    double tokens = 0;  // calls that may come now
    Time filled;
    std::array<Calls, 3> calls;
  };

  absl::Status Charge(const std::string& caller, Account& account) const
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  Account& AccountOf(const std::string& caller, Time now) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Forget(Time now) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Calls of all callers that run, or were admitted just now.
  int OpenOf(CallKind kind, Time now) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const CallerLimits limits_;
  const Clock clock_;
  Mutex mutex_;
  std::map<std::string, Account> accounts_ ABSL_GUARDED_BY(mutex_);
  std::array<int, 3> running_ ABSL_GUARDED_BY(mutex_){};
  Time forgot_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace weft
