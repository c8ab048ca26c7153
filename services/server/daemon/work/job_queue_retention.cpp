// JobQueue: ended jobs that are old enough to be forgotten.
#include <spdlog/spdlog.h>

#include <filesystem>
#include <thread>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/file/plain_text.h"
#include "services/formats/files/moved_folder.h"
#include "services/server/daemon/work/job_queue.h"
#include "services/server/daemon/work/lost_jobs.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr int kJobsPerRead = 200;

void RemoveForgotten(const std::string& folder) {
  if (const absl::Status status = RemoveAside(folder, kForgottenPrefix); !status.ok())
    spdlog::warn("{}", EscapedText(std::string(status.message())));
}

}  // namespace

// Results, and logs of tasks.
std::vector<std::string> JobQueue::OwnFolders() const {
  std::vector<std::string> folders = {options_.results_folder};
  if (const std::string logs = executor_->LogFolder("of a job"); !logs.empty())
    folders.push_back(fs::path(logs).parent_path());
  return folders;
}

std::vector<Holding> JobQueue::EndedHoldings() {
  for (const std::string& folder : OwnFolders()) RemoveForgotten(folder);
  std::vector<Holding> holdings;
  for (int64_t read = 0;;) {
    const absl::StatusOr<std::vector<v1::Job>> ended = store_->disk().EndedJobs(read, kJobsPerRead);
    if (!ended.ok()) spdlog::warn("old jobs stay: {}", std::string(ended.status().message()));
    if (!ended.ok() || ended->empty()) return holdings;
    for (const v1::Job& job : *ended) {
      if (job.finished_unix_ns() > 0)
        holdings.push_back({v1::HOLDING_KIND_JOB, job.id(), job.finished_unix_ns(), 0, false});
    }
    read += static_cast<int64_t>(ended->size());
    std::this_thread::yield();
  }
}

bool JobQueue::IsInUse(const std::string& job_id) {
  const absl::StatusOr<v1::Job> job = Get(job_id);
  if (!job.ok() || options_.is_read(job->spec().out())) return true;
  const Lock lock(mutex_);
  return table_.Find(job_id) != nullptr;
}

absl::Status JobQueue::ForgetEnded(const std::string& job_id, int64_t finished_unix_ns) {
  const MutexLock not_retried(retrying_);
  {
    const Lock lock(mutex_);
    if (table_.Find(job_id) != nullptr) return absl::FailedPreconditionError("it is watched or runs again");
  }
  WEFT_ASSIGN_OR_RETURN(const v1::Job now, store_->disk().ReadJob(job_id));
  if (now.finished_unix_ns() != finished_unix_ns)
    return absl::FailedPreconditionError("it ran again meanwhile");
  // Only what lies with the daemon is the daemon's.
  std::vector<std::string> own = {executor_->LogFolder(job_id)};
  if (const std::string results = absl::StrCat(options_.results_folder, "/", job_id);
      now.spec().out() == results)
    own.push_back(results);
  for (const std::string& folder : own) {
    if (folder.empty()) continue;
    WEFT_RETURN_IF_ERROR(PutAside(folder, kForgottenPrefix));
  }
  {
    const MutexLock nobody_reads(forgetting_);
    WEFT_RETURN_IF_ERROR(store_->disk().RemoveJob(job_id));
    published_.Remove(job_id);
  }
  for (const std::string& folder : OwnFolders()) RemoveForgotten(folder);
  return absl::OkStatus();
}

}  // namespace weft
