// SlurmExecutor: tasks of an executor that was killed.
#include <algorithm>
#include <filesystem>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "services/formats/files/json_file.h"
#include "services/work/slurm/slurm_executor.h"
#include "services/work/slurm/slurm_run.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

// Of all arrays in <jobs>/<job>, in order.
std::vector<std::string> ArrayFolders(const std::string& jobs) {
  std::vector<std::string> folders;
  std::error_code error;
  for (fs::directory_iterator job(jobs, error), end; !error && job != end; job.increment(error)) {
    std::error_code of_job;
    for (fs::directory_iterator array(job->path(), of_job); !of_job && array != end; array.increment(of_job))
      folders.push_back(array->path().string());
  }
  std::ranges::sort(folders);
  return folders;
}

// The number at the end of its name.
int NumberOf(const std::string& array_folder) {
  int number = 0;
  return absl::SimpleAtoi(array_folder.substr(array_folder.rfind('-') + 1), &number) ? number : 0;
}

}  // namespace

void SlurmExecutor::TakeUp(const Claim& claim) {
  int next_array = 1;
  for (const std::string& path : ArrayFolders(options_.folder + "/jobs")) {
    next_array = std::max(next_array, NumberOf(path) + 1);
    const TaskFolder folder(path);
    v1::SubmittedArray submitted;
    if (ReadJsonFile(folder.ArrayFile(), submitted).ok()) TakeUpArray(folder, submitted, claim);
  }
  const MutexLock lock(mutex_);
  next_array_ = next_array;
  may_begin_ = true;
  has_requests_ = true;
  woken_.notify_all();
}

void SlurmExecutor::TakeUpArray(const TaskFolder& folder, const v1::SubmittedArray& submitted,
                                const Claim& claim) {
  const auto array = std::make_shared<Array>(folder);
  array->id = submitted.id();
  array->memory_mib = submitted.memory_mib();
  std::vector<std::unique_ptr<Run>> claimed;
  std::vector<std::string> unclaimed;
  for (auto& [index, task] : folder.TasksLeft(submitted.tasks())) {
    std::optional<TaskListener> listener = claim(task);
    if (!listener) {
      unclaimed.push_back(absl::StrCat(array->id, "_", index));
      folder.Remove(index);
      continue;
    }
    auto run = std::make_unique<Run>();
    run->task = std::move(task);
    run->listener = *std::move(listener);
    run->array = array;
    run->index = index;
    run->events.emplace(folder.EventFile(index));
    run->submitted_unix_ns = submitted.submitted_unix_ns();
    run->heard = Clock::now();
    claimed.push_back(std::move(run));
  }
  // An array of which nobody wants anything is cancelled as a whole (CancelLeftovers).
  if (claimed.empty()) return folder.RemoveIfEmpty();
  array->unfinished = array->throttle = static_cast<int>(claimed.size());
  const MutexLock lock(mutex_);
  taken_up_.push_back(array);
  unclaimed_.insert(unclaimed_.end(), unclaimed.begin(), unclaimed.end());
  for (std::unique_ptr<Run>& run : claimed) {
    taken_.push_back(run->task.id());
    starts_.push_back(std::move(run));
  }
}

}  // namespace weft
