#include "services/work/plan/pilot.h"

#include <algorithm>
#include <condition_variable>
#include <memory>
#include <numeric>

#include "absl/strings/str_cat.h"
#include "base/mutex.h"
#include "base/status_code.h"
#include "base/status_macros.h"
#include "services/work/executor/local_executor.h"
#include "services/work/pipeline/registration_inputs.h"

namespace weft {
namespace {

constexpr size_t kWarmingUp = 2;  // frames of a task that are unlike those after them

// From one event to the next. Time in which other work had the core is nobody's.
struct Spent {
  double s = 0, core_s = 0;
};

Spent Between(const v1::WorkerUsage& from, const v1::WorkerUsage& to) {
  const double wall_s = to.wall_s() - from.wall_s(), delay_s = to.delay_s() - from.delay_s();
  return {.s = std::max(0.0, wall_s - std::max(0.0, delay_s)), .core_s = to.core_s() - from.core_s()};
}

double Mean(const std::vector<double>& values) {
  return values.empty()
             ? 0
             : std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

// Tasks of a pilot, as an executor runs them.
class PilotTasks {
 public:
  PilotTasks(LocalExecutor& executor, const PilotOptions& options, size_t frames)
      : executor_(executor), options_(options), frames_(frames) {}

  // Returns when all have ended.
  absl::StatusOr<std::vector<PilotTask>> Run(const std::vector<v1::Task>& tasks, std::stop_token stop) {
    const std::stop_callback on_stop(stop, [&] {
      for (const v1::Task& task : tasks) executor_.Stop(task.id());
    });
    size_t next = 0;
    MutexLock lock(mutex_);
    measured_.resize(tasks.size());
    while (next < tasks.size() && error_.ok() && !stop.stop_requested()) {
      if (running_ == options_.at_once) {
        changed_.wait(lock);
        continue;
      }
      ++running_;
      const absl::Status begun = executor_.Start(tasks[next], ListenerFor(next));
      if (!begun.ok()) {
        --running_;
        error_ = begun;
      }
      ++next;
    }
    changed_.wait(lock, [this]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return running_ == 0; });
    if (stop.stop_requested()) return absl::CancelledError("the pilot was cancelled");
    if (!error_.ok()) return error_;
    return measured_;
  }

 private:
  TaskListener ListenerFor(size_t index) {
    return {.event = [this, index](const v1::WorkerEvent& event) { OnEvent(index, event); },
            .ended = [this](const TaskEnd& end) { OnEnded(end); }};
  }

  void OnEvent(size_t index, const v1::WorkerEvent& event) {
    const MutexLock lock(mutex_);
    PilotTask& task = measured_[index];
    if (event.has_finished()) {
      task.finished.push_back(event.usage());
      options_.progress(++done_, frames_);
    }
    if (event.has_ended()) task.ended = event.usage();
    if (event.has_error() && error_.ok())
      error_ = absl::Status(StatusCodeOf(event.error().code()), event.error().message());
  }

  void OnEnded(const TaskEnd& end) {
    const MutexLock lock(mutex_);
    if (!end.clean && error_.ok()) error_ = absl::UnavailableError(absl::StrCat("a worker: ", end.reason));
    --running_;
    changed_.notify_all();
  }

  LocalExecutor& executor_;
  const PilotOptions& options_;
  const size_t frames_;
  Mutex mutex_;
  std::condition_variable_any changed_;
  std::vector<PilotTask> measured_ ABSL_GUARDED_BY(mutex_);
  absl::Status error_ ABSL_GUARDED_BY(mutex_);
  size_t done_ ABSL_GUARDED_BY(mutex_) = 0;
  int running_ ABSL_GUARDED_BY(mutex_) = 0;
};

}  // namespace

std::vector<std::vector<size_t>> PilotRuns(size_t all, size_t wanted) {
  constexpr size_t kRuns = 4, kLeastOfRun = 5;
  wanted = std::min(wanted, all);
  const size_t runs = std::clamp<size_t>(wanted / kLeastOfRun, 1, kRuns);
  std::vector<std::vector<size_t>> found;
  for (size_t run = 0; run < runs && wanted > 0; ++run) {
    const size_t length = wanted * (run + 1) / runs - wanted * run / runs;
    // Even gaps before, between and after the runs.
    std::vector<size_t> positions(length);
    std::iota(positions.begin(), positions.end(),
              (all - wanted) * (2 * run + 1) / (2 * runs) + wanted * run / runs);
    found.push_back(std::move(positions));
  }
  return found;
}

Pilot PilotFrom(const std::vector<PilotTask>& tasks) {
  Pilot pilot;
  std::vector<double> core_s, startup_s, startup_core_s;
  double wall_s = 0, delay_s = 0, frames = 0;
  const bool has_long_task =
      std::ranges::any_of(tasks, [](const PilotTask& task) { return task.finished.size() > kWarmingUp; });
  for (const PilotTask& task : tasks) {
    if (task.finished.empty()) continue;
    for (size_t i = has_long_task ? kWarmingUp : 1; i < task.finished.size(); ++i) {
      const Spent spent = Between(task.finished[i - 1], task.finished[i]);
      pilot.frame_s.push_back(spent.s);
      core_s.push_back(spent.core_s);
    }
    const Spent first = Between({}, task.finished.front());
    if (task.finished.size() >= kWarmingUp) {
      const Spent second = Between(task.finished[0], task.finished[1]);
      startup_s.push_back(std::max(0.0, first.s - second.s));
      startup_core_s.push_back(std::max(0.0, first.core_s - second.core_s));
    } else if (!has_long_task) {
      pilot.frame_s.push_back(first.s);
      core_s.push_back(first.core_s);
    }
    wall_s += task.ended.wall_s();
    delay_s += task.ended.delay_s();
    frames += static_cast<double>(task.finished.size());
    pilot.peak_memory_mib = std::max(pilot.peak_memory_mib, task.ended.peak_memory_mib());
    pilot.mib_read_per_frame += task.ended.read_mib();
    pilot.mib_written_per_frame += task.ended.written_mib();
  }
  pilot.startup_s = Mean(startup_s);
  pilot.startup_core_s = Mean(startup_core_s);
  pilot.frame_core_s = Mean(core_s);
  pilot.waited_share = wall_s > 0 ? delay_s / wall_s : 0;
  if (frames > 0) {
    pilot.mib_read_per_frame /= frames;
    pilot.mib_written_per_frame /= frames;
  }
  return pilot;
}

absl::StatusOr<Pilot> RunPilot(const v1::RegistrationSpec& asked, const PilotOptions& options,
                               std::stop_token stop) {
  v1::RegistrationSpec spec = asked;
  spec.set_out(absl::StrCat(options.out, "/results"));
  size_t job_frames = 0;
  std::vector<v1::Task> tasks;
  size_t frames = 0;
  {
    WEFT_ASSIGN_OR_RETURN(const std::unique_ptr<RegistrationInputs> inputs, LoadInputs(spec));
    const std::vector<std::string>& names = inputs->dump->frame_names();
    WEFT_ASSIGN_OR_RETURN(const std::vector<size_t> all, FramesInRange(spec, names));
    job_frames = all.size();
    for (const std::vector<size_t>& run :
         PilotRuns(all.size(), static_cast<size_t>(std::max(1, options.frames)))) {
      v1::Task task;
      task.set_id(absl::StrCat("pilot.", tasks.size()));
      task.set_threads(options.threads);
      *task.mutable_spec() = spec;
      for (const size_t position : run) task.add_frames(names[all[position]]);
      frames += run.size();
      tasks.push_back(std::move(task));
    }
  }
  LocalExecutorOptions local;
  local.worker_program = options.worker_program;
  local.task_folder = absl::StrCat(options.out, "/tasks");
  local.workers = options.at_once;
  local.allowed_paths = {"/"};  // it reads what this process may read
  WEFT_ASSIGN_OR_RETURN(std::unique_ptr<LocalExecutor> executor, LocalExecutor::Create(std::move(local)));
  PilotTasks running(*executor, options, frames);
  const absl::StatusOr<std::vector<PilotTask>> measured = running.Run(tasks, std::move(stop));
  executor->StopAll();
  if (!measured.ok()) return measured.status();
  Pilot pilot = PilotFrom(*measured);
  if (pilot.frame_s.empty()) return absl::InternalError("the pilot's workers finished no frame");
  pilot.job_frames = static_cast<int>(job_frames);
  pilot.threads = options.threads;
  return pilot;
}

}  // namespace weft
