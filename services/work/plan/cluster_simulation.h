// A job on a cluster as a sequence of events: what limits it, before anybody submits it.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/status.h"

namespace weft {

struct ClusterModel {
  int nodes = 1;
  int tasks_per_node = 1;       // that run at once
  double starts_per_s = 2;      // tasks that the scheduler starts; measured: about two
  double shared_mib_per_s = 0;  // of the shared file system, for all tasks together; 0: any
  // Mean time until a node is lost, in hours of that node, exponential; 0: never.
  double hours_between_losses = 0;
  double repair_s = 600;  // until a lost node takes tasks again
  double notice_s = 300;  // until the scheduler notices the loss (SlurmdTimeout)

  // InvalidArgument names the field.
  absl::Status Validate() const;
};

struct JobModel {
  int frames = 0;
  int frames_per_task = 1;
  double startup_s = 0;         // of each task
  std::vector<double> frame_s;  // measured times of frames, drawn at random
  double mib_per_frame = 0;     // read from and written to the shared file system
};

struct SimulatedJob {
  double wall_s = 0;      // infinite: nodes are lost sooner than tasks end
  double busy_s = 0;      // sum over tasks, lost ones included: times threads, what is paid for
  double lost_s = 0;      // work that was done again
  int tasks = 0;          // started
  int losses = 0;         // of nodes
  double slots_used = 0;  // busy_s / (wall_s * slots)
};

// Plays the job. Tasks start in order as slots are free and the scheduler's rate allows; running tasks share
// the file system evenly; finished frames of a lost node stay, and the others are a new task at the end of
// the queue. The same seed gives the same times. `job.frame_s` must not be empty.
SimulatedJob SimulateJob(const ClusterModel& cluster, const JobModel& job, uint64_t seed);

}  // namespace weft
