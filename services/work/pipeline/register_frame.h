// One frame, from images to mesh.
#pragma once

#include <stop_token>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/formats/options/presets.h"
#include "services/work/pipeline/frame_cloud.h"
#include "services/work/pipeline/registration_inputs.h"
#include "weft/v1/report.pb.h"

namespace weft {

// Decodes every view, triangulates, cleans and aligns frame `index` of the dump, and writes its files to
// <out>/<frame>/, report.json last. Views whose image is missing or broken make the frame degraded; a frame
// that cannot be registered gets a report with state FAILED and the reason, and no mesh. Observations and
// cloud that were computed by then are kept. Cancelled: `stop` was requested; nothing of this frame stands
// under a final name that was not there before. Errors of the output folder are those of WriteFileAtomically.
// Runs in the calling thread's TBB arena; the files are the same at any thread count, times and memory in the
// report aside.
absl::StatusOr<v1::FrameReport> RegisterFrame(const RegistrationInputs& inputs, size_t index,
                                              const JobOptions& options, const std::string& out,
                                              const FrameProgress& progress, std::stop_token stop);

// Notes in the report what it is computed from and by, now and here.
void SignReport(const RegistrationInputs& inputs, const v1::RegistrationOptions& options,
                v1::FrameReport& report);

// What a job tells of a frame.
v1::FrameInfo SummaryOf(const v1::FrameReport& report, bool reused);

}  // namespace weft
