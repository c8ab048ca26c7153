// JobQueue: whose job gets the next worker.
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "services/server/callers/owners.h"
#include "services/server/daemon/work/job_queue.h"
#include "services/server/daemon/work/job_queue_state.h"
#include "services/work/kinds/work_kind.h"

namespace weft {

void JobQueue::Schedule() {
  if (!BeginsTasks()) return;
  std::set<std::string> passed_over;  // whose folders others hold
  while (tasks_.size() < static_cast<size_t>(executor_->slots())) {
    const std::shared_ptr<LiveJob> job = NextJob(passed_over);
    if (job == nullptr) return;
    if (!HoldsFolder(job)) {
      passed_over.insert(job->job().id());
    } else if (!StartTask(job)) {
      return;
    }
  }
}

// None: nothing is to be done now.
std::shared_ptr<JobQueue::LiveJob> JobQueue::NextJob(const std::set<std::string>& passed_over) {
  std::vector<std::shared_ptr<LiveJob>> jobs;  // the first of each caller
  std::vector<std::string> callers;
  std::set<std::string> seen;
  for (const auto& job : jobs_) {
    if (!jobs.empty() && PriorityClass(job->job().priority()) < PriorityClass(jobs.front()->job().priority()))
      break;
    if (seen.contains(job->caller()) || passed_over.contains(job->job().id()) || !MayBeginTask(*job))
      continue;
    seen.insert(job->caller());
    callers.push_back(job->caller());
    jobs.push_back(job);
  }
  return jobs.empty() ? nullptr : jobs[turns_.Next(callers)];
}

bool JobQueue::MayBeginTask(const LiveJob& job) const {
  if (job.ended || job.life.is_aborted() || job.checking || job.start_again) return false;
  if ((job.life.following() && !job.take_settled) || !job.life.frames().HasWaiting()) return false;
  return KindOf(job.job().spec()).order() == WorkKind::Order::kApart || !HasTasks(job);
}

}  // namespace weft
