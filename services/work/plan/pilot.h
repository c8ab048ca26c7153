// A few frames of a job, registered to measure what all of them will take.
#pragma once

#include <cstddef>
#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "weft/v1/job.pb.h"
#include "weft/v1/task.pb.h"

namespace weft {

struct PilotOptions {
  int frames = 20;
  int threads = 1;             // of a worker
  int at_once = 1;             // workers, as many as a node will run
  std::string worker_program;  // weft-worker
  std::string out;             // gets tasks and results; an absolute path without links
  std::function<void(size_t done, size_t all)> progress = [](size_t, size_t) {};
};

// What was measured. Reading and writing are those of the workers, from files and from the cache alike. Times
// are those of cores that nobody else uses: what a worker waited for a core is left out, so other work on the
// machine lengthens none of them.
struct Pilot {
  int job_frames = 0;  // that the job has
  int threads = 1;
  double startup_s = 0, startup_core_s = 0;  // of a task, beside its frames; means
  std::vector<double> frame_s;               // of each frame that was measured
  double frame_core_s = 0;                   // in the mean
  double waited_share = 0;                   // of the time, for a core
  double peak_memory_mib = 0;                // of a worker
  double mib_read_per_frame = 0, mib_written_per_frame = 0;
};

// Positions of the frames of a pilot among `all`: up to four runs of neighbours, since neighbours are refined
// together, spread evenly. Each run is a task.
std::vector<std::vector<size_t>> PilotRuns(size_t all, size_t wanted);

// What a worker had taken when it told `started` and `finished` of its frames, in their order.
struct PilotTask {
  std::vector<v1::WorkerUsage> finished;
  v1::WorkerUsage ended;
};

// The times of frames are those of a task's third frame on, which find their neighbours complete and refine
// one; its second is taken for its first without what only the start of a worker takes. Shorter tasks count
// with all that they have. `tasks` must hold a frame.
Pilot PilotFrom(const std::vector<PilotTask>& tasks);

// Registers them by workers on this machine. Errors of LoadInputs, FramesInRange, LocalExecutor::Create and
// of the workers.
absl::StatusOr<Pilot> RunPilot(const v1::RegistrationSpec& spec, const PilotOptions& options,
                               std::stop_token stop);

}  // namespace weft
