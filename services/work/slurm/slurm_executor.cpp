#include "services/work/slurm/slurm_executor.h"

#include <algorithm>
#include <limits>
#include <random>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "base/host_clock.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/work/slurm/slurm_run.h"

namespace weft {
namespace {

constexpr int kMostSubmitted = 1000;  // MaxArraySize of Slurm is 1001 where nobody changed it
constexpr int kParallelWhereUnlimited = 64;
constexpr int64_t kFirstMemoryMib = 4096;  // before anything was measured
constexpr int64_t kLeastMemoryMib = 512;
constexpr double kMemoryMargin = 1.5;
constexpr std::chrono::milliseconds kGather{150};  // tasks of one array come at once
constexpr std::chrono::seconds kSubmitAgain{5};
// sbatch itself waits 20 s for room, and this thread with it.
constexpr std::chrono::seconds kSubmitWhenFull{30};

bool IsPlainTaskName(const std::string& name) {
  return !name.empty() && name.size() < 200 && name.front() != '.' &&
         name.find_first_of(std::string_view("/\0", 2)) == std::string::npos;
}

// In --output, where % begins a pattern.
std::string Unpatterned(const std::string& path) { return absl::StrReplaceAll(path, {{"%", "%%"}}); }

// The executor's name in the comments of its jobs, the same for each executor on the folder.
absl::StatusOr<std::string> TagOf(const std::string& folder) {
  WEFT_RETURN_IF_ERROR(CreateFolders(folder));
  const std::string file = absl::StrCat(folder, "/executor");
  if (const absl::StatusOr<std::string> known = ReadWholeFile(file); known.ok())
    return std::string(absl::StripAsciiWhitespace(*known));
  std::random_device random;
  const std::string tag =
      absl::StrCat(absl::Hex(random(), absl::kZeroPad8), absl::Hex(random(), absl::kZeroPad8));
  WEFT_RETURN_IF_ERROR(WriteFileAtomically(file, tag + "\n"));
  return tag;
}

}  // namespace

absl::StatusOr<std::unique_ptr<SlurmExecutor>> SlurmExecutor::Create(SlurmOptions options) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  WEFT_ASSIGN_OR_RETURN(PathMap map, PathMap::Create(options.mapped_paths));
  WEFT_ASSIGN_OR_RETURN(SlurmCommands commands, SlurmCommands::Find(options.programs_folder));
  WEFT_ASSIGN_OR_RETURN(std::string tag, TagOf(options.folder));
  std::unique_ptr<SlurmExecutor> executor(
      new SlurmExecutor(std::move(options), std::move(map), std::move(commands), std::move(tag)));
  {
    const MutexLock lock(executor->join_mutex_);
    executor->thread_ = std::thread(&SlurmExecutor::Loop, executor.get());
  }
  return executor;
}

SlurmExecutor::SlurmExecutor(SlurmOptions options, PathMap map, SlurmCommands commands, std::string tag)
    : options_(std::move(options)),
      map_(std::move(map)),
      commands_(std::move(commands)),
      tag_(std::move(tag)) {}

SlurmExecutor::~SlurmExecutor() { StopAll(); }

int SlurmExecutor::slots() const { return kMostSubmitted; }

TaskShape SlurmExecutor::shape() const {
  return {.parallel = options_.tasks > 0 ? options_.tasks : kParallelWhereUnlimited,
          .least_frames = options_.frames_per_task,
          .most_frames = options_.frames_per_task,
          .is_queued = true};
}

std::string SlurmExecutor::LogFolder(const std::string& job_id) const {
  return absl::StrCat(options_.folder, "/jobs/", job_id);
}

absl::Status SlurmExecutor::Start(const v1::Task& task, TaskListener listener) {
  for (const std::string* name : {&task.id(), &task.job_id()}) {
    if (!IsPlainTaskName(*name))
      return absl::InvalidArgumentError(absl::StrCat("task: \"", *name, "\" is not a plain name"));
  }
  const MutexLock lock(mutex_);
  if (stopping_) return absl::UnavailableError("the executor is shutting down");
  if (taken_.size() >= static_cast<size_t>(slots())) return absl::ResourceExhaustedError("too many tasks");
  if (std::ranges::find(taken_, task.id()) != taken_.end())
    return absl::AlreadyExistsError(absl::StrCat("task \"", task.id(), "\" runs already"));
  auto run = std::make_unique<Run>();
  run->task = task;
  run->listener = std::move(listener);
  run->heard = Clock::now();
  may_begin_ = true;
  taken_.push_back(task.id());
  starts_.push_back(std::move(run));
  has_requests_ = true;
  woken_.notify_all();
  return absl::OkStatus();
}

void SlurmExecutor::Stop(const std::string& task_id) {
  const MutexLock lock(mutex_);
  stops_.push_back(task_id);
  has_requests_ = true;
  woken_.notify_all();
}

void SlurmExecutor::StopAll() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
    has_requests_ = true;
    woken_.notify_all();
  }
  const MutexLock lock(join_mutex_);
  if (thread_.joinable()) thread_.join();
}

void SlurmExecutor::Loop() {
  for (;;) {
    const bool stopping = TakeRequests();
    CancelStopped();
    ReadEvents();
    if (begins_) QueryIfSilent();
    Conclude();
    if (stopping && runs_.empty()) return;
    if (!stopping) {
      Submit();
      RaiseThrottles();
    }
    RemoveEnded();
    MutexLock lock(mutex_);
    // Without tasks there is nothing to look at.
    const auto wakes = [this]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return has_requests_; };
    if (runs_.empty() && (knows_leftovers_ || !begins_)) {
      woken_.wait(lock, wakes);
    } else {
      woken_.wait_for(lock, options_.event_period, wakes);
    }
  }
}

bool SlurmExecutor::TakeRequests() {
  std::vector<std::string> stops;
  bool stopping = false;
  {
    const MutexLock lock(mutex_);
    for (std::unique_ptr<Run>& start : starts_) runs_.push_back(std::move(start));
    starts_.clear();
    for (const std::shared_ptr<Array>& array : taken_up_) {
      own_arrays_.insert(array->id);
      arrays_.push_back(array);
    }
    taken_up_.clear();
    begins_ = may_begin_;
    stops.swap(stops_);
    stopping = stopping_;
    has_requests_ = false;
  }
  if (stopping && !stop_by_) stop_by_ = Clock::now() + options_.stop_patience;
  for (const std::unique_ptr<Run>& run : runs_) {
    if (stopping || std::ranges::find(stops, run->task.id()) != stops.end()) run->was_stopped = true;
  }
  return stopping;
}

int SlurmExecutor::Room() const {
  if (options_.tasks == 0) return std::numeric_limits<int>::max();
  int room = options_.tasks;
  for (const std::shared_ptr<Array>& array : arrays_) room -= std::min(array->throttle, array->unfinished);
  return std::max(0, room);
}

void SlurmExecutor::Submit() {
  const Clock::time_point now = Clock::now();
  if (!knows_leftovers_ || (submit_again_ && now < *submit_again_)) return;
  submit_again_.reset();
  LearnLimits();
  std::vector<std::string> jobs;  // with tasks to submit, the first ones first
  for (const std::unique_ptr<Run>& run : runs_) {
    if (!run->array && !run->over && std::ranges::find(jobs, run->task.job_id()) == jobs.end())
      jobs.push_back(run->task.job_id());
  }
  for (const std::string& job : jobs) {
    if (Room() == 0 || submit_again_) return;
    SubmitJob(job, now);
  }
}

void SlurmExecutor::SubmitJob(const std::string& job_id, Clock::time_point now) {
  std::vector<Run*> runs;
  std::vector<const v1::Task*> tasks;
  for (const std::unique_ptr<Run>& run : runs_) {
    if (run->array || run->over || run->was_stopped || run->task.job_id() != job_id) continue;
    if (runs.size() == most_at_once_) break;
    runs.push_back(run.get());
    tasks.push_back(&run->task);
  }
  if (runs.empty() || now - runs.back()->heard < kGather) return;
  const auto array = std::make_shared<Array>(
      TaskFolder(absl::StrCat(LogFolder(job_id), "/", UtcFileName(), "-", next_array_++)));
  array->unfinished = static_cast<int>(runs.size());
  array->throttle = std::min(Room(), array->unfinished);
  array->memory_mib = MemoryFor(job_id);
  if (absl::Status status = array->folder.Write(tasks, options_, map_); !status.ok())
    return RefuseAll(runs, status);
  const absl::StatusOr<int64_t> id = commands_.Submit(SubmitArguments(*array, *tasks.front()));
  if (absl::IsUnavailable(id.status()) || absl::IsResourceExhausted(id.status())) {
    for (size_t i = 0; i < runs.size(); ++i) array->folder.Remove(static_cast<int>(i));
    array->folder.RemoveIfEmpty();
    return SubmitLater(runs.size(), id.status(), now);
  }
  if (!id.ok()) return RefuseAll(runs, id.status());
  most_at_once_ = std::min(array_limit_, std::max(most_at_once_, 2 * runs.size()));
  array->id = *id;
  own_arrays_.insert(*id);
  v1::SubmittedArray submitted;
  submitted.set_id(*id);
  submitted.set_tasks(array->unfinished);
  submitted.set_memory_mib(array->memory_mib);
  submitted.set_submitted_unix_ns(HostTime_ns());
  // Without it the next executor cancels these tasks instead of taking them up.
  WriteJsonFile(array->folder.ArrayFile(), submitted).IgnoreError();
  arrays_.push_back(array);
  for (size_t i = 0; i < runs.size(); ++i) {
    runs[i]->array = array;
    runs[i]->index = static_cast<int>(i);
    runs[i]->events.emplace(array->folder.EventFile(runs[i]->index));
    runs[i]->submitted_unix_ns = HostTime_ns();
    runs[i]->heard = Clock::now();
  }
}

// Tasks that Slurm did not take. Fewer of them may do at once, where they were too many.
void SlurmExecutor::SubmitLater(size_t elements, const absl::Status& status, Clock::time_point now) {
  const absl::string_view said = status.message();
  if (absl::IsUnavailable(status)) {
    submit_again_ = now + kSubmitAgain;
    return ReportWaiting(absl::StrCat("waits for Slurm, which takes no task now: ", said));
  }
  most_at_once_ = std::max<size_t>(1, elements / 2);
  submit_again_ = elements > 1 ? now : Clock::now() + kSubmitWhenFull;
  ReportWaiting(
      absl::StrCat("waits for Slurm, which does not take ", elements, " more ",
                   elements == 1 ? "task" : "tasks", " now: ", said,
                   "; see MaxJobCount, MaxArraySize and MinJobAge of `scontrol show config`, and the "
                   "limits on submitted jobs of the account"));
}

void SlurmExecutor::LearnLimits() {
  if (knows_limits_) return;
  knows_limits_ = true;
  // What does not answer is learnt from what sbatch refuses.
  const absl::StatusOr<int> most = commands_.MostElements();
  array_limit_ = static_cast<size_t>(std::min(most.value_or(kMostSubmitted), kMostSubmitted));
  most_at_once_ = array_limit_;
}

std::vector<std::string> SlurmExecutor::SubmitArguments(const Array& array, const v1::Task& first) const {
  constexpr int kHighestPriority = 100;
  const std::string folder = map_.OnNodes(array.folder.path());
  std::vector<std::string> words = {
      "--parsable",
      absl::StrCat("--array=0-", array.unfinished - 1,
                   options_.tasks > 0 ? absl::StrCat("%", array.throttle) : std::string()),
      absl::StrCat("--job-name=weft-", first.job_id()),
      absl::StrCat("--comment=weft:", tag_),
      absl::StrCat("--output=", Unpatterned(folder), "/log-%a"),
      "--open-mode=append",
      "--chdir=/",
      "--no-requeue",
      "--nodes=1",
      "--ntasks=1",
      absl::StrCat("--cpus-per-task=", options_.cpus_per_task),
      absl::StrCat("--mem=", array.memory_mib, "M"),
      absl::StrCat("--nice=", std::max(0, kHighestPriority - first.priority()))};
  const auto add = [&words](const char* option, const std::string& value) {
    if (!value.empty()) words.push_back(absl::StrCat(option, value));
  };
  add("--time=", options_.time_limit_min > 0 ? absl::StrCat(options_.time_limit_min) : "");
  add("--partition=", options_.partition);
  add("--account=", options_.account);
  add("--qos=", options_.qos);
  words.insert(words.end(), options_.extra.begin(), options_.extra.end());
  words.push_back(array.folder.Script());
  return words;
}

// Where the disk is full the tasks may come again; everything else is no fault that time mends.
void SlurmExecutor::RefuseAll(const std::vector<Run*>& runs, const absl::Status& status) {
  TaskVerdict verdict;
  verdict.end.reason = std::string(status.message());
  verdict.end.refused = absl::IsResourceExhausted(status);
  if (!verdict.end.refused) {
    verdict.error.emplace();
    verdict.error->set_code("FAILED_PRECONDITION");
    verdict.error->set_message(absl::StrCat(
        "its tasks cannot be given to Slurm: ", verdict.end.reason,
        "; start weftd with other options of Slurm (`weftd --help` lists them), then `weft job retry` "
        "goes on"));
  }
  for (Run* run : runs) End(*run, verdict);
}

void SlurmExecutor::RaiseThrottles() {
  constexpr std::chrono::seconds kPeriod{2};
  const Clock::time_point now = Clock::now();
  if (options_.tasks == 0 || (next_raise_ && now < *next_raise_)) return;
  next_raise_ = now + kPeriod;
  for (const std::shared_ptr<Array>& array : arrays_) {
    const int wanted = std::min(array->unfinished, array->throttle + Room());
    if (wanted <= array->throttle) continue;
    // An array that has ended meanwhile takes no limit.
    if (commands_.SetThrottle(array->id, wanted).ok()) array->throttle = wanted;
  }
}

int64_t SlurmExecutor::MemoryFor(const std::string& job_id) const {
  if (options_.memory_mib > 0) return options_.memory_mib;
  const auto known = peak_mib_.find(job_id);
  if (known == peak_mib_.end()) return kFirstMemoryMib;
  return std::max(kLeastMemoryMib, static_cast<int64_t>(known->second * kMemoryMargin));
}

void SlurmExecutor::RemoveEnded() {
  std::erase_if(runs_, [](const std::unique_ptr<Run>& run) { return run->over; });
  std::erase_if(arrays_, [](const std::shared_ptr<Array>& array) { return array->unfinished == 0; });
}

void SlurmExecutor::ReportWaiting(const std::string& why) {
  std::set<std::string> told;
  for (const std::unique_ptr<Run>& run : runs_) {
    if (run->over || !told.insert(run->task.job_id()).second) continue;
    run->listener.waits(why);
  }
}

}  // namespace weft
