// JobQueue: ended jobs that are old enough to be forgotten.
#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "base/host_clock.h"
#include "services/daemon/job_queue.h"
#include "services/daemon/job_queue_state.h"
#include "services/daemon/lost_jobs.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr int kJobsPerRead = 200;
constexpr double kDay_s = 24 * 3600;

bool EndedBefore(const v1::Job& job, int64_t time_ns) {
  return job.finished_unix_ns() > 0 && job.finished_unix_ns() < time_ns;
}

void RemoveForgotten(const std::string& folder) {
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    std::error_code failed;
    if (!absl::StartsWith(it->path().filename().string(), kForgottenPrefix)) continue;
    fs::remove_all(it->path(), failed);
    if (failed) spdlog::warn("{}: cannot be removed: {}", it->path().string(), failed.message());
  }
}

// Out of the way at once. The name says what a daemon that is killed here was at.
std::error_code PutAside(const std::string& folder, const std::string& job_id) {
  std::error_code error;
  fs::rename(folder, fs::path(folder).parent_path() / absl::StrCat(kForgottenPrefix, job_id), error);
  return error == std::errc::no_such_file_or_directory ? std::error_code() : error;
}

}  // namespace

void JobQueue::SetKeepDays(double days) {
  const Lock lock(mutex_);
  keep_days_ = days;
  WakeAt(forget_due_, std::chrono::steady_clock::now());
}

void JobQueue::PlanForgetting() {
  if (keep_days_ <= 0) return;
  const double pause_s = std::clamp(keep_days_ * kDay_s / 10, 1.0, 3600.0);
  WakeAt(forget_due_, std::chrono::steady_clock::now() + std::chrono::milliseconds(int64_t(1000 * pause_s)));
}

// The disk and whoever knows what is read are asked without the lock.
void JobQueue::ForgetOldJobs() {
  Lock lock(mutex_);
  const double days = keep_days_;
  const int64_t before_ns = HostTime_ns() - static_cast<int64_t>(days * kDay_s * 1e9);
  std::vector<v1::Job> old;
  for (int64_t read = 0; days > 0;) {
    const absl::StatusOr<std::vector<v1::Job>> ended = catalogue_->EndedJobs(read, kJobsPerRead);
    if (!ended.ok()) spdlog::warn("old jobs stay: {}", std::string(ended.status().message()));
    if (!ended.ok() || ended->empty()) break;
    for (const v1::Job& job : *ended) {
      if (EndedBefore(job, before_ns)) old.push_back(job);
    }
    read += static_cast<int64_t>(ended->size());
    lock.unlock();
    std::this_thread::yield();
    lock.lock();
  }
  lock.unlock();
  // Results, and logs of tasks.
  std::vector<std::string> folders = {options_.results_folder};
  if (const std::string logs = executor_->LogFolder("of a job"); !logs.empty())
    folders.push_back(fs::path(logs).parent_path());
  for (const std::string& folder : folders) RemoveForgotten(folder);
  int forgotten = 0;
  for (const v1::Job& job : old) forgotten += !options_.is_read(job.spec().out()) && ForgetOld(job);
  for (const std::string& folder : folders) RemoveForgotten(folder);
  if (forgotten > 0) {
    spdlog::info("{} job{} forgotten, since {} ended more than {:g} days ago", forgotten,
                 forgotten == 1 ? " is" : "s are", forgotten == 1 ? "it" : "they", days);
  }
  lock.lock();
  if (forgotten > 0) PlanBackup();
  PlanForgetting();
}

// Whether it is gone. It may be watched, or have been retried meanwhile.
bool JobQueue::ForgetOld(const v1::Job& job) {
  const Lock lock(mutex_);
  if (FindLive(job.id()) != nullptr) return false;
  const absl::StatusOr<v1::Job> now = catalogue_->ReadJob(job.id());
  if (!now.ok() || now->finished_unix_ns() != job.finished_unix_ns()) return false;
  // Only what lies with the daemon is the daemon's.
  std::vector<std::string> own = {executor_->LogFolder(job.id())};
  if (const std::string results = absl::StrCat(options_.results_folder, "/", job.id());
      job.spec().out() == results)
    own.push_back(results);
  for (const std::string& folder : own) {
    if (folder.empty()) continue;
    if (const std::error_code error = PutAside(folder, job.id())) {
      spdlog::warn("job {} stays: {} cannot be removed: {}", job.id(), folder, error.message());
      return false;
    }
  }
  if (const absl::Status status = catalogue_->RemoveJob(job.id()); !status.ok()) {
    spdlog::warn("job {} stays: {}", job.id(), std::string(status.message()));
    return false;
  }
  published_.Remove(job.id());
  return true;
}

}  // namespace weft
