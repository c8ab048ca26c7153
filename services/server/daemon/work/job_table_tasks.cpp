// JobTable: from jobs to tasks, and what becomes of them.
#include <algorithm>
#include <set>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "capture/file/plain_text.h"
#include "services/ground/process/no_threads.h"
#include "services/server/callers/owners.h"
#include "services/server/daemon/work/job_table.h"
#include "services/work/kinds/work_kind.h"

namespace weft {
namespace {

// A full disk, or a moment without threads or processes: as the worker told it, or as its last words did.
bool LacksRoom(const std::optional<v1::TaskError>& error, const TaskEnd& end) {
  if (end.refused) return true;
  if (error) return error->reason() != v1::ERROR_REASON_UNSPECIFIED;
  return !end.clean && IsLackOfThreads(end.reason);
}

bool IsResult(v1::FrameState state) {
  return state == v1::FRAME_STATE_DONE || state == v1::FRAME_STATE_DEGRADED ||
         state == v1::FRAME_STATE_FAILED;
}

}  // namespace

// Null: nothing is to be done now.
JobRef JobTable::NextJob() {
  // It was its turn when its folder was asked for.
  const auto ready = std::find_if(jobs_.begin(), jobs_.end(), [this](const JobRef& job) {
    return job->has_folder && MayBeginTask(*job);
  });
  if (ready != jobs_.end()) return *ready;
  std::vector<JobRef> first;  // of each caller
  std::vector<std::string> callers;
  std::set<std::string> seen;
  for (const JobRef& job : jobs_) {
    if (!first.empty() &&
        PriorityClass(job->job().priority()) < PriorityClass(first.front()->job().priority()))
      break;
    if (seen.contains(job->caller()) || !MayBeginTask(*job)) continue;
    seen.insert(job->caller());
    callers.push_back(job->caller());
    first.push_back(job);
  }
  return first.empty() ? nullptr : first[turns_.Next(callers)];
}

bool JobTable::MayBeginTask(const TableJob& job) const {
  if (job.reserved || job.ended || job.life.is_aborted() || job.checking || job.start_again ||
      job.taking_folder)
    return false;
  if ((job.life.following() && !job.take_settled) || !job.life.frames().HasWaiting()) return false;
  return KindOf(job.job().spec()).order() == WorkKind::Order::kApart || !HasTasks(job);
}

std::optional<PlannedTask> JobTable::NextTask(int slots, const TaskShape& shape) {
  if (!BeginsTasks()) return std::nullopt;
  const auto has_slot = [&] {
    const auto taking =
        std::count_if(jobs_.begin(), jobs_.end(), [](const JobRef& job) { return job->taking_folder; });
    return static_cast<int>(tasks_.size()) + static_cast<int>(taking) < slots;
  };
  while (has_slot()) {
    const JobRef job = NextJob();
    if (job == nullptr) return std::nullopt;
    if (!job->has_folder) {
      job->taking_folder = true;
      effects_.files.emplace_back(job, JobEffects::Files::kTakeFolder);
      continue;
    }
    auto running = std::make_unique<RunningTask>();
    running->job = job;
    const ChunkLimits limits = {.least = static_cast<size_t>(shape.least_frames),
                                .most = static_cast<size_t>(shape.most_frames)};
    running->positions = KindOf(job->job().spec()).order() == WorkKind::Order::kInSequence
                             ? job->life.frames().TakeAll()
                             : job->life.frames().TakeChunk(shape.parallel, limits);
    PlannedTask planned{job, {}};
    v1::Task& task = planned.task;
    task.set_id(absl::StrCat(job->id(), ".", next_task_++));
    task.set_job_id(job->id());
    task.set_priority(job->job().priority());
    *task.mutable_spec() = job->job().spec();
    *task.mutable_spec()->mutable_expected() = job->job().inputs();
    // Neighbours that are still to come would refine them again.
    if (job->life.following()) task.mutable_spec()->mutable_options()->set_frames_alone(true);
    task.set_threads(options_.threads_per_worker);
    for (const size_t position : running->positions) task.add_frames(job->infos()[position].frame());
    tasks_[task.id()] = std::move(running);
    return planned;
  }
  return std::nullopt;
}

void JobTable::EndRound() {
  for (const JobRef& job : jobs_) job->has_folder = false;
}

void JobTable::Began(const PlannedTask& planned, const std::string& task_logs, JobTime now) {
  const auto found = tasks_.find(planned.task.id());
  if (found == tasks_.end()) return;
  found->second->handed_out = now;
  Log(JobEffects::Level::kDebug,
      absl::StrCat("task ", planned.task.id(), ": ", planned.task.frames_size(), " frames from ",
                   planned.task.frames_size() > 0 ? planned.task.frames(0) : ""));
  turns_.Begin(planned.job->caller());
  planned.job->life.SetTaskLogs(task_logs);
  if (planned.job->life.Start()) ChangeJob(planned.job);
}

void JobTable::CouldNotBegin(const PlannedTask& planned, const std::string& why, JobTime now) {
  const auto found = tasks_.find(planned.task.id());
  if (found == tasks_.end()) return;
  Log(JobEffects::Level::kError, absl::StrCat("task ", planned.task.id(), " cannot be started: ", why));
  for (const size_t position : found->second->positions)
    planned.job->life.frames().Requeue(position, JobFrames::Attempt::kRefunded);
  tasks_.erase(found);
  WaitForRoom(planned.job, why, now);
}

bool JobTable::TakeUp(const v1::Task& task, const std::string& task_logs, JobTime now) {
  int64_t number = 0;
  if (absl::SimpleAtoi(task.id().substr(task.id().rfind('.') + 1), &number))
    next_task_ = std::max(next_task_, number + 1);
  const JobRef job = Find(task.job_id());
  if (job == nullptr || job->ended || job->life.is_aborted() || job->life.following()) return false;
  auto running = std::make_unique<RunningTask>();
  running->job = job;
  running->is_taken_up = true;
  running->handed_out = now;
  for (const std::string& frame : task.frames()) {
    const std::optional<size_t> position = job->life.frames().Find(frame);
    if (position && !job->life.frames().IsProcessed(*position)) running->positions.push_back(*position);
  }
  if (running->positions.empty()) return false;
  for (const size_t position : running->positions) job->life.frames().Take(position);
  Log(JobEffects::Level::kInfo,
      absl::StrCat("task ", task.id(), " runs on: ", running->positions.size(), " frames"));
  tasks_[task.id()] = std::move(running);
  turns_.Begin(job->caller());
  job->life.SetTaskLogs(task_logs);
  if (job->life.Start()) ChangeJob(job);
  return true;
}

bool JobTable::HasTasks(const TableJob& job) const {
  return std::any_of(tasks_.begin(), tasks_.end(),
                     [&job](const auto& entry) { return entry.second->job.get() == &job; });
}

int JobTable::FramesRunning(const RunningTask& task) const {
  const std::vector<v1::FrameInfo>& infos = task.job->infos();
  return static_cast<int>(std::count_if(
      task.positions.begin(), task.positions.end(),
      [&infos](size_t position) { return infos[position].state() == v1::FRAME_STATE_RUNNING; }));
}

void JobTable::OnEvent(const std::string& task_id, const v1::WorkerEvent& event, int64_t host_time_ns) {
  const auto found = tasks_.find(task_id);
  if (found == tasks_.end()) return;
  RunningTask& task = *found->second;
  if (event.has_usage()) task.usage = event.usage();
  if (event.has_error()) {
    task.error = event.error();
  } else if (!event.has_ended() && !event.has_began()) {
    OnFrameEvent(task, event, host_time_ns);
    if (!BeginsTasks() && event.has_finished() && FramesRunning(task) == 0)
      effects_.stop_tasks.push_back(task_id);
  }
}

void JobTable::OnFrameEvent(RunningTask& task, const v1::WorkerEvent& event, int64_t host_time_ns) {
  const JobRef& ref = task.job;
  TableJob& job = *ref;
  JobFrames& frames = job.life.frames();
  const std::string& frame = event.has_started()    ? event.started().frame()
                             : event.has_advanced() ? event.advanced().frame()
                                                    : event.finished().frame();
  const std::optional<size_t> position = frames.Find(frame);
  if (!position || std::count(task.positions.begin(), task.positions.end(), *position) == 0 ||
      frames.IsProcessed(*position)) {
    if (task.is_taken_up) return;
    Log(JobEffects::Level::kWarning,
        absl::StrCat("job ", job.id(), ": a worker speaks of frame \"", frame, "\", which is not its own"));
    return;
  }
  const bool running = job.infos()[*position].state() == v1::FRAME_STATE_RUNNING;
  task.began = true;
  job.failed_starts = 0;
  if (event.has_finished()) job.pause = std::chrono::seconds(1);
  if (event.has_finished() && !job.life.is_aborted()) job.life.SetMessage("");
  if (event.has_advanced()) {
    if (running) frames.Advance(*position, event.advanced().share_done());
    return Show(ref);
  }
  if (!running) frames.Start(*position);
  if (event.has_finished() && IsResult(event.finished().state())) {
    frames.Finish(*position, event.finished());
    ++(event.finished().state() == v1::FRAME_STATE_FAILED ? frames_failed_ : frames_done_);
    // The refinement of meshes that this job made while it followed its take is no repetition.
    if (job.job().spec().live_every() > 0) frames.ForgetRedone(*position);
    if (job.life.following() && *position < job.recorded_ns.size()) {
      job.life.SetLatency(*position, static_cast<double>(host_time_ns - job.recorded_ns[*position]) * 1e-9);
      ++job.version;
    }
    Log(JobEffects::Level::kDebug,
        absl::StrCat("job ", job.id(), ": frame ", frame, " ", v1::FrameState_Name(event.finished().state()),
                     " ", event.finished().reason()));
  }
  ChangeFrame(ref, *position);
}

void JobTable::OnTaskEnded(const std::string& task_id, const TaskEnd& end, JobTime now) {
  const auto found = tasks_.find(task_id);
  if (found == tasks_.end()) return;
  const std::unique_ptr<RunningTask> task = std::move(found->second);
  tasks_.erase(found);
  const JobRef& job = task->job;
  turns_.End(job->caller(), std::chrono::duration<double>(now - task->handed_out).count());
  job->life.CountTask(end.lost, end.queued_s);
  if (task->usage) job->life.AddUsage(*task->usage);
  ++job->version;
  ReturnFrames(*task, end, now);
  Show(job);
  StopFollowingIfIdle(job);
  FinishIfDone(job);
}

void JobTable::ReturnFrames(RunningTask& task, const TaskEnd& end, JobTime now) {
  TableJob& job = *task.job;
  JobFrames& frames = job.life.frames();
  std::erase_if(task.positions, [&frames](size_t position) { return frames.IsProcessed(position); });
  const auto requeue = [&](JobFrames::Attempt attempt) {
    for (const size_t position : task.positions) frames.Requeue(position, attempt);
  };
  // A worker that reports CANCELLED was stopped: by us, or by somebody who is no reason to give up the job.
  const bool no_room = LacksRoom(task.error, end);
  const bool given_up = task.error && task.error->code() != "CANCELLED" && !no_room;
  if (given_up && !stopping_) Abort(task.job, v1::JOB_STATE_FAILED, task.error->message());
  if (job.life.is_aborted()) {
    for (const size_t position : task.positions)
      frames.End(position, v1::FRAME_STATE_CANCELLED, job.life.abort_message());
  } else if (!BeginsTasks()) {
    requeue(JobFrames::Attempt::kRefunded);
  } else if (no_room) {
    requeue(JobFrames::Attempt::kRefunded);
    WaitForRoom(task.job, task.error ? task.error->message() : end.reason, now);
  } else if (end.lost) {
    requeue(JobFrames::Attempt::kRefunded);
    if (!task.positions.empty()) {
      Note(task.job,
           absl::StrCat(task.positions.size(), task.positions.size() == 1 ? " frame is" : " frames are",
                        " registered again: ", end.reason));
    }
  } else if (!task.positions.empty()) {
    BlameWorker(task, end.clean ? "its worker ended without dealing with it" : end.reason);
  }
  for (const size_t position : task.positions) ChangeFrame(task.job, position);
}

void JobTable::OnTaskWaits(const std::string& task_id, const std::string& why) {
  const auto found = tasks_.find(task_id);
  if (found == tasks_.end()) return;
  const JobRef& job = found->second->job;
  const std::string message = EscapedText(why);
  if (job->life.is_aborted() || job->job().message() == message) return;
  Log(JobEffects::Level::kInfo, absl::StrCat("job ", job->id(), ": ", message));
  job->life.SetMessage(message);
  ChangeJob(job);
}

void JobTable::OnTaskNoted(const std::string& task_id, const std::string& note) {
  const auto found = tasks_.find(task_id);
  if (found != tasks_.end()) Note(found->second->job, note);
}

// A warning of the job, as long as there are few.
void JobTable::Note(const JobRef& job, const std::string& text) {
  constexpr int kMostNotes = 50;
  Log(JobEffects::Level::kWarning, absl::StrCat("job ", job->id(), ": ", text));
  if (++job->notes > kMostNotes) return;
  job->life.AddWarning(job->notes == kMostNotes ? "more about its tasks is in the log of weftd"
                                                : EscapedText(text));
  ChangeJob(job);
}

// A disk without room is no fault of the job: it waits, longer each time.
void JobTable::WaitForRoom(const JobRef& job, const std::string& reason, JobTime now) {
  constexpr std::chrono::seconds kLongestPause{30};
  if (job->start_again) return;  // it waits already
  Log(JobEffects::Level::kWarning,
      absl::StrCat("job ", job->id(), " waits ", job->pause.count(), " s: ", reason));
  job->life.SetMessage(absl::StrCat("waits until there is room: ", EscapedText(reason)));
  job->start_again = now + job->pause;
  job->pause = std::min(2 * job->pause, kLongestPause);
  ChangeJob(job);
}

// The worker ended before its time: who is to blame is the frame at which it was, or the first that it had
// not begun.
void JobTable::BlameWorker(RunningTask& task, const std::string& reason) {
  TableJob& job = *task.job;
  JobFrames& frames = job.life.frames();
  Log(JobEffects::Level::kWarning, absl::StrCat("job ", job.id(), ": a worker ended abnormally: ", reason));
  if (!task.began && ++job.failed_starts >= kMaxAttempts) {
    Abort(task.job, v1::JOB_STATE_FAILED, absl::StrCat("its workers end before they begin: ", reason));
    for (const size_t position : task.positions)
      frames.End(position, v1::FRAME_STATE_CANCELLED, job.life.abort_message());
    return;
  }
  const auto is_running = [&job](size_t position) {
    return job.infos()[position].state() == v1::FRAME_STATE_RUNNING;
  };
  auto blamed = std::find_if(task.positions.begin(), task.positions.end(), is_running);
  if (blamed == task.positions.end()) blamed = task.positions.begin();
  for (auto it = task.positions.begin(); it != task.positions.end(); ++it) {
    if (it != blamed || !task.began) {
      frames.Requeue(*it, JobFrames::Attempt::kRefunded);
      continue;
    }
    if (!is_running(*it)) frames.Start(*it);
    if (job.infos()[*it].attempts() < kMaxAttempts) {
      frames.Requeue(*it, JobFrames::Attempt::kCounts);
    } else {
      Quarantine(task.job, *it, reason);
    }
  }
}

void JobTable::Quarantine(const JobRef& job, size_t position, const std::string& reason) {
  const int attempts = job->infos()[position].attempts();
  job->life.frames().End(
      position, v1::FRAME_STATE_FAILED,
      absl::StrCat("its workers ended abnormally ", attempts, " times; last: ", EscapedText(reason)));
  ++frames_failed_;
  const v1::FrameInfo& info = job->infos()[position];
  Log(JobEffects::Level::kError,
      absl::StrCat("job ", job->id(), ": frame ", info.frame(), " is set aside: ", info.reason()));
  effects_.quarantined.push_back({job, info});
}

}  // namespace weft
