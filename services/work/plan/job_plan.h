// From a pilot to what a job will take on a cluster, and into which tasks it should be cut.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "services/work/plan/cluster_simulation.h"
#include "services/work/plan/pilot.h"
#include "weft/v1/job_plan.pb.h"

namespace weft {

struct PlanRequest {
  int cores = 1;
  int frames_per_task = 0;  // 0: chosen
  double starts_per_s = 2;  // of the scheduler
  // Until a scheduler has given the slot of a task that ended to the next one, and its worker runs.
  double launch_s = 0.5;
  double shared_mib_per_s = 0;      // of the shared file system; 0: any
  double hours_between_losses = 0;  // of a node; 0: never
  int cores_per_node = 32;          // that are lost together
  double core_speed = 1;            // of the cluster's cores, relative to those of the pilot
  std::vector<int> other_cores;     // for comparison

  // InvalidArgument names the field.
  absl::Status Validate() const;
};

// Times of the pilot are drawn for the frames of the job, and the job is played (SimulateJob) for several
// sizes of tasks. `core_speed` divides processor time; what a frame waits for files stays as it is. Of those
// within 1 % of the shortest wall time, the one with the fewest core-hours is chosen. Errors of Validate;
// FailedPrecondition: fewer cores than the pilot had threads.
absl::StatusOr<v1::JobPlan> PlanJob(const Pilot& pilot, const PlanRequest& request);

// For people, a fact on each line.
std::string JobPlanText(const v1::JobPlan& plan);

}  // namespace weft
