#include "services/work/executor/local_executor.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <deque>
#include <optional>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/ground/process/exit_status.h"
#include "services/work/worker/worker_event.h"

namespace weft {
namespace {

constexpr size_t kLastWords = 8;
constexpr size_t kMaxLastWordBytes = 400;

bool IsPlainName(const std::string& name) {
  return !name.empty() && name.size() < 200 && name.front() != '.' &&
         name.find_first_of(std::string_view("/\0", 2)) == std::string::npos;
}

}  // namespace

struct LocalExecutor::Run {
  v1::Task task;
  TaskListener listener;
  std::optional<ChildProcess> child;
  LineSplitter out, err;
  std::deque<std::string> last_words;
  Clock::time_point heard;
  std::optional<Clock::time_point> kill_at;  // set when it was asked to stop
  std::string stopped_because;
  bool finished = false;
  bool refused = false;

  void Persist(const std::string& line) {
    if (line.empty()) return;
    last_words.push_back(line.substr(0, kMaxLastWordBytes));
    if (last_words.size() > kLastWords) last_words.pop_front();
  }
};

absl::Status LocalExecutorOptions::Validate() const {
  if (worker_program.empty()) return absl::InvalidArgumentError("worker_program: must not be empty");
  if (task_folder.empty()) return absl::InvalidArgumentError("task_folder: must not be empty");
  if (workers < 1 || workers > 1024) {
    return absl::InvalidArgumentError(absl::StrCat("workers: ", workers, ", must be 1 to 1024"));
  }
  if (worker_memory_mib < 0) return absl::InvalidArgumentError("worker_memory_mib: must not be negative");
  if (stop_grace.count() < 0) return absl::InvalidArgumentError("stop_grace: must not be negative");
  if (silence_limit.count() <= 0) return absl::InvalidArgumentError("silence_limit: must be positive");
  return absl::OkStatus();
}

absl::StatusOr<std::unique_ptr<LocalExecutor>> LocalExecutor::Create(LocalExecutorOptions options) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  if (access(options.worker_program.c_str(), X_OK) != 0) {
    return absl::NotFoundError(
        absl::StrCat(options.worker_program, ": no such program; it is installed beside weftd"));
  }
  WEFT_RETURN_IF_ERROR(CreateFolders(options.task_folder));
  std::unique_ptr<LocalExecutor> executor(new LocalExecutor(std::move(options)));
  if (!executor->wake_.open()) return absl::ResourceExhaustedError("no file descriptor left");
  {
    const MutexLock lock(executor->join_mutex_);
    executor->thread_ = std::thread(&LocalExecutor::Loop, executor.get());
  }
  return executor;
}

LocalExecutor::LocalExecutor(LocalExecutorOptions options)
    : options_(std::move(options)), wake_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}

LocalExecutor::~LocalExecutor() { StopAll(); }

absl::Status LocalExecutor::Start(const v1::Task& task, TaskListener listener) {
  if (!IsPlainName(task.id())) {
    return absl::InvalidArgumentError(absl::StrCat("task.id: \"", task.id(), "\" is not a plain name"));
  }
  const MutexLock lock(mutex_);
  if (stopping_) return absl::UnavailableError("the executor is shutting down");
  if (taken_.size() >= static_cast<size_t>(options_.workers)) {
    return absl::ResourceExhaustedError("every worker is busy");
  }
  if (std::ranges::find(taken_, task.id()) != taken_.end()) {
    return absl::AlreadyExistsError(absl::StrCat("task \"", task.id(), "\" runs already"));
  }
  auto run = std::make_unique<Run>();
  run->task = task;
  run->listener = std::move(listener);
  taken_.push_back(task.id());
  starts_.push_back(std::move(run));
  Wake();
  return absl::OkStatus();
}

void LocalExecutor::Stop(const std::string& task_id) {
  const MutexLock lock(mutex_);
  stops_.push_back(task_id);
  Wake();
}

void LocalExecutor::StopAll() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
    Wake();
  }
  const MutexLock lock(join_mutex_);
  if (thread_.joinable()) thread_.join();
}

void LocalExecutor::Wake() const {
  const uint64_t one = 1;
  // Fails only when the counter is full, and then the loop is awake anyway.
  [[maybe_unused]] const ssize_t written = write(wake_.get(), &one, sizeof(one));
}

void LocalExecutor::Loop() {
  for (;;) {
    const bool stopping = TakeRequests();
    if (stopping && runs_.empty()) return;
    EnforceDeadlines();
    WaitForEvents();
    for (auto& [id, run] : runs_) Listen(*run);
    RemoveFinished();
  }
}

// Starts and stops what was asked for; true when no more will come.
bool LocalExecutor::TakeRequests() {
  std::vector<std::unique_ptr<Run>> starts;
  std::vector<std::string> stops;
  bool stopping = false;
  {
    const MutexLock lock(mutex_);
    starts.swap(starts_);
    stops.swap(stops_);
    stopping = stopping_;
  }
  for (std::unique_ptr<Run>& start : starts) {
    Run& run = *start;
    runs_[run.task.id()] = std::move(start);
    Launch(run);
  }
  for (const std::string& id : stops) {
    if (const auto found = runs_.find(id); found != runs_.end()) BeginStop(*found->second, "stopped");
  }
  if (stopping) {
    for (auto& [id, run] : runs_) BeginStop(*run, "stopped");
  }
  RemoveFinished();
  return stopping;
}

void LocalExecutor::Launch(Run& run) {
  const std::string task_file = absl::StrCat(options_.task_folder, "/", run.task.id(), ".json");
  absl::Status status = CreateFolders(options_.task_folder);
  run.task.mutable_allowed_paths()->Assign(options_.allowed_paths.begin(), options_.allowed_paths.end());
  run.task.set_state_folder(options_.state_folder);
  if (status.ok()) status = WriteJsonFile(task_file, run.task);
  run.refused = !status.ok();
  if (status.ok()) {
    std::vector<std::string> words = {task_file, "--parent", absl::StrCat(getpid()), "--memory-mib",
                                      absl::StrCat(options_.worker_memory_mib)};
    if (!options_.worker_user.empty()) words.push_back(absl::StrCat("--user=", options_.worker_user));
    absl::StatusOr<ChildProcess> child = ChildProcess::Spawn(
        options_.worker_program, words, {.record_folder = options_.process_folder, .hides_secrets = true});
    status = child.status();
    run.refused = absl::IsResourceExhausted(status);
    if (child.ok()) run.child.emplace(*std::move(child));
  }
  run.heard = Clock::now();
  if (status.ok()) return;
  run.stopped_because = std::string(status.message());
  run.finished = true;
}

void LocalExecutor::BeginStop(Run& run, const std::string& why) {
  if (run.finished || run.kill_at) return;
  run.stopped_because = why;
  run.kill_at = Clock::now() + options_.stop_grace;
  run.child->Signal(SIGTERM);
}

void LocalExecutor::EnforceDeadlines() {
  const Clock::time_point now = Clock::now();
  for (auto& [id, run] : runs_) {
    if (run->finished) continue;
    if (!run->kill_at && now - run->heard >= options_.silence_limit) {
      run->stopped_because = absl::StrCat("hangs: it reported nothing for ",
                                          absl::StrCat(options_.silence_limit.count() / 1000.0), " s");
      run->kill_at = now;
    }
    if (run->kill_at && now >= *run->kill_at) run->child->Signal(SIGKILL);
  }
}

void LocalExecutor::WaitForEvents() {
  std::vector<pollfd> fds = {{wake_.get(), POLLIN, 0}};
  std::optional<Clock::time_point> next;
  const Clock::time_point now = Clock::now();
  for (const auto& [id, run] : runs_) {
    for (const int fd : {run->child->out_fd(), run->child->err_fd(), run->child->exit_fd()}) {
      if (fd >= 0) fds.push_back({fd, POLLIN, 0});
    }
    // Killed already: its end is all that is awaited.
    if (run->kill_at && *run->kill_at <= now) continue;
    const Clock::time_point due = run->kill_at ? *run->kill_at : run->heard + options_.silence_limit;
    next = next ? std::min(*next, due) : due;
  }
  int timeout_ms = -1;
  if (next) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(*next - now).count();
    timeout_ms = static_cast<int>(std::clamp<int64_t>(left, 0, 3600'000));
  }
  poll(fds.data(), fds.size(), timeout_ms);
  uint64_t count = 0;
  [[maybe_unused]] const ssize_t n = read(wake_.get(), &count, sizeof(count));
}

void LocalExecutor::Listen(Run& run) {
  pollfd exited = {run.child->exit_fd(), POLLIN, 0};
  const bool ended = poll(&exited, 1, 0) > 0;  // asked first, so that nothing it printed is missed
  for (const std::string& line : run.out.Add(run.child->ReadOut())) OnOutput(run, line);
  for (const std::string& line : run.err.Add(run.child->ReadErr())) run.Persist(line);
  if (ended) Finish(run);
}

void LocalExecutor::OnOutput(Run& run, const std::string& line) {
  const absl::StatusOr<v1::WorkerEvent> event = ParseWorkerEvent(line);
  if (!event.ok()) {
    run.Persist(line);
    return;
  }
  run.heard = Clock::now();
  run.listener.event(*event);
}

void LocalExecutor::Finish(Run& run) {
  run.Persist(run.out.TakeRest());
  run.Persist(run.err.TakeRest());
  const std::string exit = DescribeExit(run.child->Reap());
  if (run.stopped_because.empty() && exit != "exit status 0") {
    run.stopped_because = exit;
    if (!run.last_words.empty()) {
      absl::StrAppend(&run.stopped_because, "; its last output: ", absl::StrJoin(run.last_words, " | "));
    }
  }
  run.finished = true;
}

// Frees the slots before telling, so that listeners can start the next task.
void LocalExecutor::RemoveFinished() {
  for (auto it = runs_.begin(); it != runs_.end();) {
    if (!it->second->finished) {
      ++it;
      continue;
    }
    const std::unique_ptr<Run> run = std::move(it->second);
    it = runs_.erase(it);
    run->child.reset();
    RemoveFile(absl::StrCat(options_.task_folder, "/", run->task.id(), ".json"));
    {
      const MutexLock lock(mutex_);
      std::erase(taken_, run->task.id());
    }
    run->listener.ended({run->stopped_because.empty(), run->stopped_because, run->refused});
  }
}

}  // namespace weft
