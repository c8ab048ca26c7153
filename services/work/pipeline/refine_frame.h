// The temporal pass over the files of a job: refines frames by those before and after, bridges failed ones.
#pragma once

#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "alignment/temporal.h"
#include "services/work/pipeline/frame_neighbors.h"
#include "services/work/pipeline/registration_inputs.h"
#include "weft/v1/report.pb.h"

namespace weft {

// A frame registered on its own is kept as <frame>/unrefined.ply; its mesh.ply follows from that file of the
// frame itself and of those before and after (alignment/temporal.h). A failed frame gets a mesh.ply between
// the nearest registered frames, at most kMaxBridge frames away on either side.
//
// The same for every frame of the job within kMaxBridge of position `at` of `job_frames` (positions in the
// dump, with their `steps`) whose neighbours are complete. The worker that completes the last neighbour of a
// frame refines it, so any number of workers in any order gives the same files. Two that do it at once write
// the same bytes. Frames that are refined already from the same neighbours are kept. So are frames whose
// files differ from their reports. Cancelled: `stop` was requested. Runs in the calling thread's TBB arena.
absl::Status RefineAround(const RegistrationInputs& inputs, const std::vector<size_t>& job_frames,
                          const FrameSteps& steps, size_t at, const TemporalOptions& options,
                          const std::string& out, std::stop_token stop);

// Of these frames of the dump, in their order.
FrameSteps StepsOf(const RegistrationInputs& inputs, const std::vector<size_t>& job_frames);

// Whether the results in `out` hold a mesh for this failed frame, made from the frames around it. Certain
// once all frames of the job are dealt with.
bool WasBridged(const std::string& out, const std::string& frame);

}  // namespace weft
