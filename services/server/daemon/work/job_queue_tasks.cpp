// JobQueue: from jobs to tasks, and what becomes of them.
#include <spdlog/spdlog.h>

#include <algorithm>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "capture/file/plain_text.h"
#include "services/ground/process/no_threads.h"
#include "services/server/daemon/work/job_queue.h"
#include "services/server/daemon/work/job_queue_state.h"
#include "services/work/kinds/work_kind.h"
#include "services/work/pipeline/frame_files.h"
#include "services/work/pipeline/stage_keys.h"

namespace weft {
namespace {

// The frame's own report, since no worker is left to write it.
absl::Status WriteQuarantineReport(const v1::Job& job, const v1::FrameInfo& info) {
  v1::FrameReport report;
  report.set_frame(info.frame());
  report.set_state(info.state());
  report.set_reason(info.reason());
  report.set_set_aside(true);
  *report.mutable_inputs() = job.inputs();
  *report.mutable_options() = job.spec().options();
  *report.mutable_keys() = KeysOf(job.inputs(), job.spec().options());
  report.set_weft_version(WEFT_VERSION);
  return WriteReportAlone(job.spec().out(), report);
}

// The worker's disk or its limit on files, by what WriteFileAtomically says of it.
bool IsFullDisk(const v1::TaskError& error) {
  return error.code() == "RESOURCE_EXHAUSTED" &&
         (absl::StrContains(error.message(), "make room on the disk") ||
          absl::StrContains(error.message(), "(ulimit -f)"));
}

// A moment without threads or processes, as the worker told it or as its end did.
bool LacksThreads(const std::optional<v1::TaskError>& error, const TaskEnd& end) {
  if (error) return error->code() == "RESOURCE_EXHAUSTED" && TellsLackOfThreads(error->message());
  return !end.clean && TellsLackOfThreads(end.reason);
}

bool IsResult(v1::FrameState state) {
  return state == v1::FRAME_STATE_DONE || state == v1::FRAME_STATE_DEGRADED ||
         state == v1::FRAME_STATE_FAILED;
}

}  // namespace

bool JobQueue::StartTask(const std::shared_ptr<LiveJob>& job) {
  auto running = std::make_unique<RunningTask>();
  running->job = job;
  const TaskShape shape = executor_->shape();
  const ChunkLimits limits = {.least = static_cast<size_t>(shape.least_frames),
                              .most = static_cast<size_t>(shape.most_frames)};
  running->positions = KindOf(job->job().spec()).order() == WorkKind::Order::kInSequence
                           ? job->life.frames().TakeAll()
                           : job->life.frames().TakeChunk(shape.parallel, limits);
  v1::Task task;
  task.set_id(absl::StrCat(job->job().id(), ".", next_task_++));
  task.set_job_id(job->job().id());
  task.set_priority(job->job().priority());
  *task.mutable_spec() = job->job().spec();
  *task.mutable_spec()->mutable_expected() = job->job().inputs();
  // Neighbours that are still to come would refine them again.
  if (job->life.following()) task.mutable_spec()->mutable_options()->set_frames_alone(true);
  task.set_threads(options_.threads_per_worker);
  for (const size_t position : running->positions) task.add_frames(job->infos()[position].frame());
  const std::string id = task.id();
  const absl::Status status = executor_->Start(task, ListenerOf(id));
  if (!status.ok()) {
    spdlog::error("task {} cannot be started: {}", id, std::string(status.message()));
    for (const size_t position : running->positions) {
      job->life.frames().Requeue(position, JobFrames::Attempt::kRefunded);
    }
    return false;
  }
  spdlog::debug("task {}: {} frames from {}", id, running->positions.size(), task.frames(0));
  tasks_[id] = std::move(running);
  turns_.Begin(job->caller());
  job->life.SetTaskLogs(executor_->LogFolder(job->job().id()));
  if (job->life.Start()) PersistJob(*job);
  return true;
}

TaskListener JobQueue::ListenerOf(const std::string& id) {
  return {[this, id](const v1::WorkerEvent& event) { OnEvent(id, event); },
          [this, id](const TaskEnd& end) { OnTaskEnded(id, end); },
          [this, id](const std::string& why) { OnTaskWaits(id, why); },
          [this, id](const std::string& note) { OnTaskNoted(id, note); }};
}

// A task that the daemon before this one started, and that runs on. None: no job waits for a frame of it.
std::optional<TaskListener> JobQueue::TakeUpTask(const v1::Task& task) {
  int64_t number = 0;
  if (absl::SimpleAtoi(task.id().substr(task.id().rfind('.') + 1), &number))
    next_task_ = std::max(next_task_, number + 1);
  const std::shared_ptr<LiveJob> job = FindLive(task.job_id());
  if (job == nullptr || job->ended || job->life.is_aborted() || job->life.following()) return std::nullopt;
  auto running = std::make_unique<RunningTask>();
  running->job = job;
  running->is_taken_up = true;
  for (const std::string& frame : task.frames()) {
    const std::optional<size_t> position = job->life.frames().Find(frame);
    if (position && !job->life.frames().IsProcessed(*position)) running->positions.push_back(*position);
  }
  if (running->positions.empty() || !HoldsFolder(job)) return std::nullopt;
  for (const size_t position : running->positions) job->life.frames().Take(position);
  spdlog::info("task {} runs on: {} frames", task.id(), running->positions.size());
  tasks_[task.id()] = std::move(running);
  turns_.Begin(job->caller());
  job->life.SetTaskLogs(executor_->LogFolder(task.job_id()));
  if (job->life.Start()) PersistJob(*job);
  return ListenerOf(task.id());
}

bool JobQueue::HasTasks(const LiveJob& job) const {
  return std::any_of(tasks_.begin(), tasks_.end(),
                     [&job](const auto& entry) { return entry.second->job.get() == &job; });
}

void JobQueue::OnEvent(const std::string& task_id, const v1::WorkerEvent& event) {
  Lock lock(mutex_);
  const auto found = tasks_.find(task_id);
  if (found == tasks_.end()) return;
  if (event.has_usage()) found->second->usage = event.usage();
  if (event.has_error()) {
    found->second->error = event.error();
  } else if (!event.has_ended() && !event.has_began()) {
    OnFrameEvent(*found->second, event);
    if (!BeginsTasks() && event.has_finished() && FramesRunning(*found->second) == 0)
      executor_->Stop(task_id);
  }
  UnlockAndTell(lock);
}

void JobQueue::OnFrameEvent(RunningTask& task, const v1::WorkerEvent& event) {
  LiveJob& job = *task.job;
  const std::string& frame = event.has_started()    ? event.started().frame()
                             : event.has_advanced() ? event.advanced().frame()
                                                    : event.finished().frame();
  const std::optional<size_t> position = job.life.frames().Find(frame);
  if (!position || std::count(task.positions.begin(), task.positions.end(), *position) == 0 ||
      job.life.frames().IsProcessed(*position)) {
    if (task.is_taken_up) return;
    spdlog::warn("job {}: a worker speaks of frame \"{}\", which is not its own", job.job().id(), frame);
    return;
  }
  const bool running = job.infos()[*position].state() == v1::FRAME_STATE_RUNNING;
  task.began = true;
  job.failed_starts = 0;
  if (event.has_finished()) job.pause = std::chrono::seconds(1);
  if (event.has_finished() && !job.life.is_aborted()) job.life.SetMessage("");
  if (event.has_advanced()) {
    if (running) job.life.frames().Advance(*position, event.advanced().share_done());
    MarkChanged(job);
    return;
  }
  if (!running) job.life.frames().Start(*position);
  if (event.has_finished() && IsResult(event.finished().state())) {
    job.life.frames().Finish(*position, event.finished());
    ++(event.finished().state() == v1::FRAME_STATE_FAILED ? frames_failed_ : frames_done_);
    // The refinement of meshes that this job made while it followed its take is no repetition.
    if (job.job().spec().live_every() > 0) job.life.frames().ForgetRedone(*position);
    NoteLatency(job, *position);
    spdlog::debug("job {}: frame {} {} {}", job.job().id(), frame,
                  v1::FrameState_Name(event.finished().state()), event.finished().reason());
  }
  Persist(job, *position);
}

void JobQueue::OnTaskEnded(const std::string& task_id, const TaskEnd& end) {
  Lock lock(mutex_);
  const auto found = tasks_.find(task_id);
  if (found == tasks_.end()) return;
  const std::unique_ptr<RunningTask> task = std::move(found->second);
  tasks_.erase(found);
  const std::chrono::duration<double> lasted = std::chrono::steady_clock::now() - task->handed_out;
  turns_.End(task->job->caller(), lasted.count());
  task->job->life.CountTask(end.lost, end.queued_s);
  if (task->usage) task->job->life.AddUsage(*task->usage);
  ++task->job->version;
  ReturnFrames(*task, end);
  MarkChanged(*task->job);
  StopFollowingIfIdle(task->job);
  FinishIfDone(task->job);
  Schedule();
  UnlockAndTell(lock);
}

void JobQueue::ReturnFrames(RunningTask& task, const TaskEnd& end) {
  LiveJob& job = *task.job;
  std::erase_if(task.positions, [&job](size_t position) { return job.life.frames().IsProcessed(position); });
  // A worker that reports CANCELLED was stopped: by us, or by somebody who is no reason to give up the job.
  const bool no_room =
      end.refused || (task.error && IsFullDisk(*task.error)) || LacksThreads(task.error, end);
  const bool given_up = task.error && task.error->code() != "CANCELLED" && !no_room;
  if (given_up && !stopping_) Abort(task.job, v1::JOB_STATE_FAILED, task.error->message());
  if (job.life.is_aborted()) {
    for (const size_t position : task.positions) {
      job.life.frames().End(position, v1::FRAME_STATE_CANCELLED, job.life.abort_message());
    }
  } else if (!BeginsTasks()) {
    for (const size_t position : task.positions) {
      job.life.frames().Requeue(position, JobFrames::Attempt::kRefunded);
    }
  } else if (no_room) {
    for (const size_t position : task.positions)
      job.life.frames().Requeue(position, JobFrames::Attempt::kRefunded);
    WaitForRoom(job, task.error ? task.error->message() : end.reason);
  } else if (end.lost) {
    for (const size_t position : task.positions)
      job.life.frames().Requeue(position, JobFrames::Attempt::kRefunded);
    if (!task.positions.empty()) {
      Note(job, absl::StrCat(task.positions.size(), task.positions.size() == 1 ? " frame is" : " frames are",
                             " registered again: ", end.reason));
    }
  } else if (!task.positions.empty()) {
    BlameWorker(task, end.clean ? "its worker ended without dealing with it" : end.reason);
  }
  for (const size_t position : task.positions) Persist(job, position);
}

void JobQueue::OnTaskWaits(const std::string& task_id, const std::string& why) {
  Lock lock(mutex_);
  const auto found = tasks_.find(task_id);
  if (found == tasks_.end()) return;
  LiveJob& job = *found->second->job;
  const std::string message = EscapedText(why);
  if (job.life.is_aborted() || job.job().message() == message) return;
  spdlog::info("job {}: {}", job.job().id(), message);
  job.life.SetMessage(message);
  PersistJob(job);
  UnlockAndTell(lock);
}

void JobQueue::OnTaskNoted(const std::string& task_id, const std::string& note) {
  Lock lock(mutex_);
  const auto found = tasks_.find(task_id);
  if (found == tasks_.end()) return;
  Note(*found->second->job, note);
  UnlockAndTell(lock);
}

// A warning of the job, as long as there are few.
void JobQueue::Note(LiveJob& job, const std::string& text) {
  constexpr int kMostNotes = 50;
  spdlog::warn("job {}: {}", job.job().id(), text);
  if (++job.notes > kMostNotes) return;
  job.life.AddWarning(job.notes == kMostNotes ? "more about its tasks is in the log of weftd"
                                              : EscapedText(text));
  PersistJob(job);
}

int JobQueue::FramesRunning(const RunningTask& task) const {
  const std::vector<v1::FrameInfo>& infos = task.job->infos();
  return static_cast<int>(std::count_if(
      task.positions.begin(), task.positions.end(),
      [&infos](size_t position) { return infos[position].state() == v1::FRAME_STATE_RUNNING; }));
}

JobQueue::DrainState JobQueue::Drain(bool finish_jobs) {
  Lock lock(mutex_);
  draining_ = true;
  finishes_jobs_ = finish_jobs;
  for (const auto& [id, task] : tasks_) {
    if (!BeginsTasks() && (task->began || executor_->shape().is_queued) && FramesRunning(*task) == 0)
      executor_->Stop(id);
  }
  Schedule();
  const DrainState state = DrainStateNow();
  UnlockAndTell(lock);
  return state;
}

JobQueue::DrainState JobQueue::CurrentDrain() {
  const Lock lock(mutex_);
  return DrainStateNow();
}

JobQueue::DrainState JobQueue::DrainStateNow() const {
  DrainState state;
  state.tasks = static_cast<int>(tasks_.size());
  for (const auto& [id, task] : tasks_) state.frames += FramesRunning(*task);
  state.jobs = static_cast<int>(
      std::count_if(jobs_.begin(), jobs_.end(), [](const auto& job) { return !job->ended; }));
  state.is_drained = draining_ && tasks_.empty() && (!finishes_jobs_ || state.jobs == 0);
  return state;
}

// A disk without room is no fault of the job: it waits, longer each time.
void JobQueue::WaitForRoom(LiveJob& job, const std::string& reason) {
  constexpr std::chrono::seconds kLongestPause{30};
  if (job.start_again) return;  // it waits already
  spdlog::warn("job {} waits {} s: {}", job.job().id(), job.pause.count(), reason);
  job.life.SetMessage(absl::StrCat("waits until there is room: ", EscapedText(reason)));
  WakeAt(job.start_again, std::chrono::steady_clock::now() + job.pause);
  job.pause = std::min(2 * job.pause, kLongestPause);
  PersistJob(job);
}

// The worker ended before its time: who is to blame is the frame at which it was, or the first that it had
// not begun.
void JobQueue::BlameWorker(RunningTask& task, const std::string& reason) {
  LiveJob& job = *task.job;
  spdlog::warn("job {}: a worker ended abnormally: {}", job.job().id(), reason);
  if (!task.began && ++job.failed_starts >= kMaxAttempts) {
    Abort(task.job, v1::JOB_STATE_FAILED, absl::StrCat("its workers end before they begin: ", reason));
    for (const size_t position : task.positions) {
      job.life.frames().End(position, v1::FRAME_STATE_CANCELLED, job.life.abort_message());
    }
    return;
  }
  const auto is_running = [&job](size_t position) {
    return job.infos()[position].state() == v1::FRAME_STATE_RUNNING;
  };
  auto blamed = std::find_if(task.positions.begin(), task.positions.end(), is_running);
  if (blamed == task.positions.end()) blamed = task.positions.begin();
  for (auto it = task.positions.begin(); it != task.positions.end(); ++it) {
    if (it != blamed || !task.began) {
      job.life.frames().Requeue(*it, JobFrames::Attempt::kRefunded);
      continue;
    }
    if (!is_running(*it)) job.life.frames().Start(*it);
    if (job.infos()[*it].attempts() < kMaxAttempts) {
      job.life.frames().Requeue(*it, JobFrames::Attempt::kCounts);
    } else {
      Quarantine(task.job, *it, reason);
    }
  }
}

void JobQueue::Quarantine(const std::shared_ptr<LiveJob>& job, size_t position, const std::string& reason) {
  const int attempts = job->infos()[position].attempts();
  job->life.frames().End(
      position, v1::FRAME_STATE_FAILED,
      absl::StrCat("its workers ended abnormally ", attempts, " times; last: ", EscapedText(reason)));
  ++frames_failed_;
  Persist(*job, position);
  const v1::FrameInfo info = job->infos()[position];
  spdlog::error("job {}: frame {} is set aside: {}", job->job().id(), info.frame(), info.reason());
  Defer(job, [job_copy = job->job(), info] {
    const absl::Status status = WriteQuarantineReport(job_copy, info);
    if (!status.ok()) spdlog::error("{}", std::string(status.message()));
  });
}

void JobQueue::Abort(const std::shared_ptr<LiveJob>& job, v1::JobState state, const std::string& message) {
  if (job->ended || job->finishing || job->life.is_aborted()) return;
  spdlog::info("job {} ends early: {}", job->job().id(), message);
  job->life.Abort(state, message);
  job->start_again.reset();  // its end need not wait for what its tasks waited for
  // Frames of running tasks come back when those have ended.
  std::vector<bool> in_task(job->infos().size());
  for (const auto& [id, task] : tasks_) {
    if (task->job != job) continue;
    for (const size_t position : task->positions) in_task[position] = true;
    executor_->Stop(id);
  }
  job->life.CancelWaiting([&in_task](size_t position) { return in_task[position]; });
  job->life.SetMessage(state == v1::JOB_STATE_CANCELLED ? "being cancelled" : job->life.abort_message());
  // Before any frame: a daemon that is killed from here on must not take up half of them.
  PersistJob(*job);
  FinishIfDone(job);
}

}  // namespace weft
