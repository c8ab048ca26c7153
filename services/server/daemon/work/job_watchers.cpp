#include "services/server/daemon/work/job_watchers.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "absl/strings/str_cat.h"
#include "services/server/rpc/retry_after.h"

namespace weft {
namespace {

constexpr size_t kMaxWatchers = 4096;
constexpr size_t kMaxFramesPerUpdate = 1000;
constexpr std::chrono::seconds kRetryWhereFull{5};

}  // namespace

absl::Status JobWatchers::CheckRoom() const {
  if (watchers_.size() < kMaxWatchers) return absl::OkStatus();
  return RetryLater(absl::StatusCode::kResourceExhausted,
                    absl::StrCat(watchers_.size(), " clients watch jobs, the most at once"), kRetryWhereFull);
}

int64_t JobWatchers::Add(JobRef job, std::function<void()> changed) {
  const int64_t id = next_++;
  watchers_[id] = {std::move(job), std::move(changed)};
  return id;
}

JobRef JobWatchers::Remove(int64_t watcher) {
  const auto found = watchers_.find(watcher);
  if (found == watchers_.end()) return nullptr;
  JobRef job = found->second.job;
  watchers_.erase(found);
  return job;
}

bool JobWatchers::AreAny(const JobRef& job) const {
  return std::any_of(watchers_.begin(), watchers_.end(),
                     [&job](const auto& entry) { return entry.second.job == job; });
}

JobWatchers::Updates JobWatchers::Poll(int64_t watcher) {
  Updates updates;
  const auto found = watchers_.find(watcher);
  if (found == watchers_.end() || found->second.saw_end) return updates;
  Watcher& own = found->second;
  const TableJob& job = *own.job;
  const JobFrames::Changes changes = job.life.frames().ChangedSince(own.seen_frames, kMaxFramesPerUpdate);
  if (changes.positions.empty() && own.seen_job == job.version) return updates;
  v1::JobUpdate update;
  *update.mutable_job() = job.life.Describe();
  for (const size_t position : changes.positions) *update.add_frames() = job.infos()[position];
  own.seen_frames = changes.up_to;
  own.seen_job = job.version;
  own.saw_end = updates.ended = job.ended && changes.up_to == job.life.frames().version();
  updates.update = std::move(update);
  return updates;
}

void JobWatchers::Collect(const JobRef& job, std::vector<std::function<void()>>* to_call) const {
  for (const auto& [id, watcher] : watchers_) {
    if (watcher.job == job) to_call->push_back(watcher.changed);
  }
}

void JobWatchers::CollectAll(std::vector<std::function<void()>>* to_call) const {
  for (const auto& [id, watcher] : watchers_) to_call->push_back(watcher.changed);
}

}  // namespace weft
