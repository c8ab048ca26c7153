#include "services/server/daemon/work/published_jobs.h"

#include <utility>

namespace weft {
namespace {

constexpr size_t kEndedJobs = 1000;  // some kB each

bool IsEnded(const v1::Job& job) { return job.finished_unix_ns() != 0; }

}  // namespace

void PublishedJobs::Publish(v1::Job job) {
  const MutexLock lock(mutex_);
  v1::Job& known = jobs_[job.id()];
  const bool ends = IsEnded(job) && !IsEnded(known);
  known = std::move(job);
  if (!ends) return;
  ended_.push_back(known.id());
  if (ended_.size() <= kEndedJobs) return;
  const auto oldest = jobs_.find(ended_.front());
  // It may run again.
  if (oldest != jobs_.end() && IsEnded(oldest->second)) jobs_.erase(oldest);
  ended_.pop_front();
}

void PublishedJobs::Remove(const std::string& id) {
  const MutexLock lock(mutex_);
  jobs_.erase(id);
}

std::optional<v1::Job> PublishedJobs::Find(const std::string& id) const {
  const MutexLock lock(mutex_);
  const auto known = jobs_.find(id);
  return known == jobs_.end() ? std::nullopt : std::optional<v1::Job>(known->second);
}

}  // namespace weft
