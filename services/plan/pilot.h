// A few frames of a job, registered to measure what all of them will take.
#pragma once

#include <cstddef>
#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "weft/v1/job.pb.h"

namespace weft {

struct PilotOptions {
  int frames = 20;
  int threads = 1;
  std::string out;  // gets the results; an absolute path without links
  std::function<void(size_t done, size_t all)> progress = [](size_t, size_t) {};
};

// What was measured. Reading and writing are those of the process, from files and from the cache alike.
struct Pilot {
  int job_frames = 0;  // that the job has
  int threads = 1;
  double startup_s = 0, startup_core_s = 0;  // until the inputs are loaded
  std::vector<double> frame_s;               // of each frame
  double frame_core_s = 0;                   // in the mean
  double peak_memory_mib = 0;                // of this process
  double mib_read_per_frame = 0, mib_written_per_frame = 0;
};

// Positions of the frames of a pilot among `all`: up to four runs of neighbours, since neighbours are refined
// together, spread evenly.
std::vector<size_t> PilotFrames(size_t all, size_t wanted);

// Registers them as a worker does, in this process. Errors of LoadInputs, FramesInRange and RegisterFrames.
absl::StatusOr<Pilot> RunPilot(const v1::RegistrationSpec& spec, const PilotOptions& options,
                               std::stop_token stop);

}  // namespace weft
