#include "services/work/plan/job_plan.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/status_macros.h"

namespace weft {
namespace {

constexpr double kSecondsPerHour = 3600, kMibPerGib = 1024;
constexpr double kMemoryMargin = 1.25;  // frames of the job may be larger than those of the pilot
constexpr double kEqual = 1.01;         // wall times that differ by less are the same
constexpr uint64_t kSeed = 1;

double MeanOf(const std::vector<double>& values) {
  return values.empty()
             ? 0
             : std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

// A job on so many cores with tasks of one size.
struct Cut {
  int frames_per_task = 1;
  SimulatedJob played;
  double core_hours = 0, processor_hours = 0;
};

// What takes `s`, of which processors work `core_s`, on cores of another speed.
double AtSpeed(double s, double core_s, double core_speed) {
  const double busy_s = std::min(s, core_s);
  return busy_s / core_speed + (s - busy_s);
}

ClusterModel ClusterOf(const Pilot& pilot, const PlanRequest& request, int cores) {
  const int slots = std::max(1, cores / pilot.threads);
  const int per_node = std::clamp(request.cores_per_node / pilot.threads, 1, slots);
  ClusterModel cluster;
  cluster.nodes = (slots + per_node - 1) / per_node;
  // Nodes are alike here; those of an uneven division are a little smaller.
  cluster.tasks_per_node = slots / cluster.nodes;
  cluster.starts_per_s = request.starts_per_s;
  cluster.shared_mib_per_s = request.shared_mib_per_s;
  cluster.hours_between_losses = request.hours_between_losses;
  return cluster;
}

JobModel ModelOf(const Pilot& pilot, const PlanRequest& request, int frames_per_task) {
  JobModel job;
  job.frames = pilot.job_frames;
  job.frames_per_task = frames_per_task;
  job.startup_s = AtSpeed(pilot.startup_s, pilot.startup_core_s, request.core_speed) + request.launch_s;
  const double frame_s = MeanOf(pilot.frame_s);
  const double scale = frame_s > 0 ? AtSpeed(frame_s, pilot.frame_core_s, request.core_speed) / frame_s : 1;
  for (const double s : pilot.frame_s) job.frame_s.push_back(s * scale);
  job.mib_per_frame = pilot.mib_read_per_frame + pilot.mib_written_per_frame;
  return job;
}

Cut Play(const Pilot& pilot, const PlanRequest& request, int cores, int frames_per_task) {
  Cut cut;
  cut.frames_per_task = frames_per_task;
  cut.played = SimulateJob(ClusterOf(pilot, request, cores), ModelOf(pilot, request, frames_per_task), kSeed);
  const double launching_s = cut.played.tasks * request.launch_s;  // when nobody has the core
  cut.core_hours = (cut.played.busy_s - launching_s) * pilot.threads / kSecondsPerHour;
  cut.processor_hours =
      (pilot.job_frames * pilot.frame_core_s + cut.played.tasks * pilot.startup_core_s) / kSecondsPerHour;
  return cut;
}

Cut Choose(const Pilot& pilot, const PlanRequest& request, int cores) {
  if (request.frames_per_task > 0)
    return Play(pilot, request, cores, std::min(request.frames_per_task, pilot.job_frames));
  std::vector<Cut> cuts;
  for (const int size : {1, 2, 3, 4, 5, 6, 8, 10, 12, 15, 18, 24, 30, 40, 50, 60, 80, 100, 150, 200, 300}) {
    if (size > pilot.job_frames) break;
    cuts.push_back(Play(pilot, request, cores, size));
  }
  const auto shortest = std::ranges::min_element(
      cuts, [](const Cut& a, const Cut& b) { return a.played.wall_s < b.played.wall_s; });
  const double enough_s = shortest->played.wall_s * kEqual;
  Cut best = *shortest;
  for (const Cut& cut : cuts) {
    if (cut.played.wall_s <= enough_s && cut.core_hours < best.core_hours) best = cut;
  }
  return best;
}

// The bound that the wall time comes nearest to.
std::string LimitOf(const Pilot& pilot, const PlanRequest& request, int cores, const Cut& cut) {
  const double frames = pilot.job_frames;
  const double slots = std::max(1, cores / pilot.threads);
  const JobModel model = ModelOf(pilot, request, cut.frames_per_task);
  const double task_s = cut.frames_per_task * MeanOf(model.frame_s) + model.startup_s;
  const double tasks = std::ceil(frames / cut.frames_per_task);
  const double mib = frames * (pilot.mib_read_per_frame + pilot.mib_written_per_frame);
  const double by_files_s = request.shared_mib_per_s > 0 ? mib / request.shared_mib_per_s : 0;
  const double by_starts_s = request.starts_per_s > 0 ? tasks / request.starts_per_s : 0;
  const double by_cores_s = tasks * task_s / slots;
  if (by_files_s > std::max(by_cores_s, by_starts_s)) {
    return absl::StrFormat("the shared file system: %.1f GiB at %.0f MiB/s take %.0f s", mib / kMibPerGib,
                           request.shared_mib_per_s, by_files_s);
  }
  if (by_starts_s > by_cores_s) {
    return absl::StrFormat("the scheduler: %.0f tasks at %.1f starts a second take %.0f s", tasks,
                           request.starts_per_s, by_starts_s);
  }
  if (tasks < slots) {
    return absl::StrFormat("the number of tasks: %.0f tasks leave %.0f of %d cores idle", tasks,
                           (slots - tasks) * pilot.threads, cores);
  }
  constexpr double kWellUsed = 0.8;
  if (cut.played.slots_used < kWellUsed) {
    return absl::StrFormat(
        "the last tasks: cores work %.0f %% of the time, since tasks of %.0f s end unevenly",
        100 * cut.played.slots_used, task_s);
  }
  return absl::StrFormat("the cores: they work %.0f %% of the time", 100 * cut.played.slots_used);
}

void DescribePilot(const Pilot& pilot, v1::JobPilot& out) {
  out.set_frames_registered(static_cast<int>(pilot.frame_s.size()));
  out.set_threads(pilot.threads);
  out.set_startup_s(pilot.startup_s);
  out.set_startup_core_s(pilot.startup_core_s);
  out.set_frame_s(MeanOf(pilot.frame_s));
  out.set_frame_core_s(pilot.frame_core_s);
  out.set_longest_frame_s(*std::ranges::max_element(pilot.frame_s));
  out.set_peak_memory_mib(pilot.peak_memory_mib);
  out.set_mib_read_per_frame(pilot.mib_read_per_frame);
  out.set_mib_written_per_frame(pilot.mib_written_per_frame);
  out.set_waited_share(pilot.waited_share);
}

std::string Duration(double seconds) {
  if (seconds < 120) return absl::StrFormat("%.0f s", seconds);
  if (seconds < 2 * kSecondsPerHour) return absl::StrFormat("%.0f min", seconds / 60);
  return absl::StrFormat("%.1f h", seconds / kSecondsPerHour);
}

}  // namespace

absl::Status PlanRequest::Validate() const {
  const auto wrong = [](const char* field, double value) {
    return absl::InvalidArgumentError(absl::StrCat(field, ": ", value, " is out of range"));
  };
  if (cores < 1 || cores > 1'000'000) return wrong("cores", cores);
  if (frames_per_task < 0) return wrong("frames_per_task", frames_per_task);
  if (cores_per_node < 1) return wrong("cores_per_node", cores_per_node);
  for (const int other : other_cores) {
    if (other < 1 || other > 1'000'000) return wrong("other_cores", other);
  }
  if (!(launch_s >= 0) || !std::isfinite(launch_s)) return wrong("launch_s", launch_s);
  if (!(core_speed > 0) || !std::isfinite(core_speed)) return wrong("core_speed", core_speed);
  ClusterModel cluster;
  cluster.starts_per_s = starts_per_s;
  cluster.shared_mib_per_s = shared_mib_per_s;
  cluster.hours_between_losses = hours_between_losses;
  return cluster.Validate();
}

absl::StatusOr<v1::JobPlan> PlanJob(const Pilot& pilot, const PlanRequest& request) {
  WEFT_RETURN_IF_ERROR(request.Validate());
  if (pilot.frame_s.empty() || pilot.threads < 1 || pilot.job_frames < 1)
    return absl::InvalidArgumentError("pilot: has no frame");
  if (request.cores < pilot.threads) {
    return absl::FailedPreconditionError(
        absl::StrCat("cores: ", request.cores, ", but a task has ", pilot.threads, " (--cpus-per-task)"));
  }
  const Cut cut = Choose(pilot, request, request.cores);
  v1::JobPlan plan;
  DescribePilot(pilot, *plan.mutable_pilot());
  plan.set_frames(pilot.job_frames);
  plan.set_cores(request.cores);
  plan.set_cpus_per_task(pilot.threads);
  plan.set_frames_per_task(cut.frames_per_task);
  plan.set_tasks((pilot.job_frames + cut.frames_per_task - 1) / cut.frames_per_task);
  plan.set_wall_s(cut.played.wall_s);
  plan.set_core_hours(cut.core_hours);
  plan.set_processor_hours(cut.processor_hours);
  plan.set_memory_mib(std::ceil(pilot.peak_memory_mib * kMemoryMargin));
  plan.set_gib_read(pilot.job_frames * pilot.mib_read_per_frame / kMibPerGib);
  plan.set_gib_written(pilot.job_frames * pilot.mib_written_per_frame / kMibPerGib);
  plan.set_limited_by(LimitOf(pilot, request, request.cores, cut));
  plan.set_use(cut.played.slots_used);
  for (const int cores : request.other_cores) {
    if (cores < pilot.threads) continue;
    const Cut other = Choose(pilot, request, cores);
    v1::JobPlanRow& row = *plan.add_other_cores();
    row.set_cores(cores);
    row.set_frames_per_task(other.frames_per_task);
    row.set_wall_s(other.played.wall_s);
    row.set_core_hours(other.core_hours);
    row.set_processor_hours(other.processor_hours);
    row.set_use(other.played.slots_used);
  }
  return plan;
}

std::string JobPlanText(const v1::JobPlan& plan) {
  const v1::JobPilot& pilot = plan.pilot();
  std::string text = absl::StrFormat(
      "pilot       %d frames with %d threads: %.2f s a frame, %.2f s at most, %.2f core-seconds; %.2f s to "
      "start\n",
      pilot.frames_registered(), pilot.threads(), pilot.frame_s(), pilot.longest_frame_s(),
      pilot.frame_core_s(), pilot.startup_s());
  constexpr double kBusyMachine = 0.1;
  if (pilot.waited_share() > kBusyMachine) {
    absl::StrAppendFormat(&text,
                          "            other work had its cores %.0f %% of the time, which is left out\n",
                          100 * pilot.waited_share());
  }
  absl::StrAppendFormat(&text, "frames      %d\ntasks       %d of %d frames\n", plan.frames(), plan.tasks(),
                        plan.frames_per_task());
  absl::StrAppendFormat(&text, "wall time   %s on %d cores\ncore-hours  %.2f\n", Duration(plan.wall_s()),
                        plan.cores(), plan.core_hours());
  absl::StrAppendFormat(&text, "memory      %.0f MiB a task\nfiles       %.2f GiB read, %.2f GiB written\n",
                        plan.memory_mib(), plan.gib_read(), plan.gib_written());
  absl::StrAppend(&text, "limited by  ", plan.limited_by(), "\n");
  for (const v1::JobPlanRow& row : plan.other_cores()) {
    absl::StrAppendFormat(&text, "%6d cores  %s, %.2f core-hours, tasks of %d frames, %.0f %% used\n",
                          row.cores(), Duration(row.wall_s()), row.core_hours(), row.frames_per_task(),
                          100 * row.use());
  }
  absl::StrAppendFormat(&text,
                        "options     weftd --slurm-frames-per-task %d --slurm-cpus-per-task %d "
                        "--slurm-memory-mib %.0f\n",
                        plan.frames_per_task(), plan.cpus_per_task(), plan.memory_mib());
  return text;
}

}  // namespace weft
