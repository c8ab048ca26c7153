// A job on clusters of many sizes, played as a sequence of events: where it stops getting faster, and what
// lost nodes cost. The tables of docs/scale.md.
#include <CLI/CLI.hpp>

#include <cstdio>
#include <string>
#include <vector>

#include "services/work/plan/job_plan.h"

namespace {

struct Case {
  int frames = 18000;
  double frame_s = 300;
  double startup_s = 3;
  double mib_per_frame = 2400;
  double spread = 0.2;  // of the times of frames, as a share
  int cores_per_node = 32;
};

weft::Pilot PilotOf(const Case& job) {
  constexpr int kTimes = 21;
  weft::Pilot pilot;
  pilot.job_frames = job.frames;
  pilot.startup_s = job.startup_s;
  pilot.mib_read_per_frame = job.mib_per_frame;
  for (int i = 0; i < kTimes; ++i)
    pilot.frame_s.push_back(job.frame_s * (1 + job.spread * (2.0 * i / (kTimes - 1) - 1)));
  pilot.frame_core_s = job.frame_s;
  return pilot;
}

// One row; false where a request is not valid.
bool Print(const weft::Pilot& pilot, const weft::PlanRequest& request) {
  const absl::StatusOr<weft::v1::JobPlan> plan = weft::PlanJob(pilot, request);
  if (!plan.ok()) {
    std::fprintf(stderr, "%s\n", std::string(plan.status().message()).c_str());
    return false;
  }
  std::printf("%6d  %8.0f  %7.0f  %6d  %8.2f  %10.1f  %5.1f  %s\n", request.cores, request.shared_mib_per_s,
              request.hours_between_losses, plan->frames_per_task(), plan->wall_s() / 3600,
              plan->core_hours(), 100 * plan->use(), plan->limited_by().c_str());
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  Case job;
  CLI::App app("Plays a job on clusters of many sizes");
  app.option_defaults()->always_capture_default();
  app.add_option("--frames", job.frames, "Frames of the job");
  app.add_option("--frame-s", job.frame_s, "Core-seconds of a frame, in the mean");
  app.add_option("--startup-s", job.startup_s, "Time until a worker has its inputs");
  app.add_option("--mib-per-frame", job.mib_per_frame, "Read and written");
  app.add_option("--spread", job.spread, "Half the range of the times, as a share of the mean");
  app.add_option("--cores-per-node", job.cores_per_node, "Cores that are lost together");
  CLI11_PARSE(app, argc, argv);
  const weft::Pilot pilot = PilotOf(job);
  std::printf(" cores     MiB/s  h/loss  frames    wall h  core-hours  used%%  limited by\n");
  weft::PlanRequest request;
  request.cores_per_node = job.cores_per_node;
  bool is_valid = true;
  for (const double mib_per_s : {0.0, 2000.0, 10000.0}) {
    request.shared_mib_per_s = mib_per_s;
    for (const int cores : {32, 128, 512, 1000, 2000, 4000}) {
      request.cores = cores;
      is_valid &= Print(pilot, request);
    }
  }
  request.cores = 1000;
  request.shared_mib_per_s = 0;
  for (const double hours : {10'000.0, 1000.0, 100.0, 20.0, 5.0}) {
    request.hours_between_losses = hours;
    is_valid &= Print(pilot, request);
  }
  return is_valid ? 0 : 1;
}
