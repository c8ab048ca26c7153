// The last known state of jobs, for readers that shall not wait for the disk.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <string>

#include "base/mutex.h"
#include "weft/v1/job.pb.h"

namespace weft {

// Holds every job that has not ended, and the last ones that have. Thread safety: any thread.
class PublishedJobs {
 public:
  void Publish(v1::Job job);
  void Remove(const std::string& id);
  std::optional<v1::Job> Find(const std::string& id) const;

 private:
  mutable Mutex mutex_;
  std::map<std::string, v1::Job> jobs_ ABSL_GUARDED_BY(mutex_);
  std::deque<std::string> ended_
      ABSL_GUARDED_BY(mutex_);  // ids, the oldest first; one that was retried may stand here twice
};

}  // namespace weft
