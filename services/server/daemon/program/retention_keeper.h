// Removes what the retention says, slowly, and says so beforehand.
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "base/mutex.h"
#include "services/server/access/audit_log.h"
#include "services/server/retention/retention_policy.h"

namespace weft {

// Things of some kinds, with whoever holds them.
struct RetentionSource {
  std::set<v1::HoldingKind> kinds;
  std::chrono::seconds longest_pause{60};  // between two looks; less where things are kept for less
  std::function<std::vector<Holding>()> list;
  // Whether it must wait, which Holding.kept does not say yet.
  std::function<bool(const RetentionStep& step)> is_in_use = [](const RetentionStep&) { return false; };
  std::function<absl::Status(const RetentionStep& step)> carry;
};

struct RetentionKeeperOptions {
  std::string state_file;    // a RetentionState
  std::string takes_folder;  // on the disk that shall keep room
  v1::RetentionRules rules;
  std::vector<RetentionSource> sources;
};

// Each step is a line of the audit log before it is done; where the log takes none, it waits. Sources and log
// must outlive it. Thread safety: any thread may call any function.
class RetentionKeeper {
 public:
  RetentionKeeper(RetentionKeeperOptions options, AuditLog& audit);
  ~RetentionKeeper();

  void SetRules(const v1::RetentionRules& rules);
  // What would go within so many days, by these rules instead of those in force.
  v1::RetentionRehearsal Rehearse(const v1::RetentionRules& rules, double ahead_days);

 private:
  using Clock = std::chrono::steady_clock;

  void Work(const std::stop_token& stop);
  void PassTime() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Report(const std::vector<std::string>& notes);
  void Inspect(const RetentionSource& source, const std::stop_token& stop);
  bool Record(const RetentionStep& step, const absl::Status& status);
  void Save() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  std::chrono::milliseconds PauseOf(const RetentionSource& source) const
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  uint64_t FreeBytes() const;

  const RetentionKeeperOptions options_;
  AuditLog& audit_;
  Mutex mutex_;
  std::condition_variable_any changed_;
  RetentionPolicy policy_ ABSL_GUARDED_BY(mutex_);
  bool hurry_ ABSL_GUARDED_BY(mutex_) = false;                  // the rules changed
  std::deque<v1::RetentionStep> done_ ABSL_GUARDED_BY(mutex_);  // newest first
  std::string save_trouble_ ABSL_GUARDED_BY(mutex_);
  std::set<std::string> told_;  // notes of the worker's last looks, without their numbers
  std::jthread worker_;
};

}  // namespace weft
