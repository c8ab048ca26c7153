// Who watches which job, and what they have seen of it.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "services/server/daemon/work/job_table.h"
#include "weft/v1/jobs.pb.h"

namespace weft {

// Thread safety: none.
class JobWatchers {
 public:
  struct Updates {
    std::optional<v1::JobUpdate> update;  // none: nothing new since the last call
    bool ended = false;                   // the update is the last one
  };

  // `changed` is called after every change, without a lock. ResourceExhausted: too many watchers.
  absl::Status CheckRoom() const;
  int64_t Add(JobRef job, std::function<void()> changed);
  // The job that it watched; null: it is gone already.
  JobRef Remove(int64_t watcher);
  bool AreAny(const JobRef& job) const;
  size_t size() const { return watchers_.size(); }

  Updates Poll(int64_t watcher);
  // Whom to call after a change of this job, or of all.
  void Collect(const JobRef& job, std::vector<std::function<void()>>* to_call) const;
  void CollectAll(std::vector<std::function<void()>>* to_call) const;

 private:
  struct Watcher {
    JobRef job;
    std::function<void()> changed;
    uint64_t seen_job = 0;
    uint64_t seen_frames = 0;
    bool saw_end = false;
  };
  std::map<int64_t, Watcher> watchers_;
  int64_t next_ = 1;
};

}  // namespace weft
