// The stages of one frame in memory: decode, triangulate, clean, align, and all of it again for what was
// missed.
#pragma once

#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "services/work/pipeline/register_frame.h"
#include "services/work/pipeline/second_pass.h"

namespace weft {

struct FrameOptions {
  const PipelineOptions& pipeline;
  std::string scans;            // folder; empty where there is none
  std::string starts;           // folder of an earlier registration; empty where there is none
  size_t kept_image_bytes = 0;  // see JobOptions
};

// What a frame came to; `mesh` is empty when it could not be registered, and report.reason says why.
struct FrameResult {
  v1::FrameReport report;
  std::vector<ViewObservations> views;
  Cloud cloud;
  std::optional<RegisteredMesh> mesh;
};

// Runs in the calling thread's TBB arena. Cancelled when `stop` was requested. Errors of a scan or a
// start that cannot be read; InvalidArgument where the start is a mesh of another template.
absl::StatusOr<FrameResult> ComputeFrame(const RegistrationInputs& inputs, size_t index,
                                         const FrameOptions& options, const FrameProgress& progress,
                                         std::stop_token stop);

// The last stage alone, for a frame whose cloud is that of its file and whose report tells of images and
// cloud already. Errors as ComputeFrame.
absl::Status AlignFrame(const RegistrationInputs& inputs, size_t index, const FrameOptions& options,
                        std::stop_token stop, FrameResult& frame);

}  // namespace weft
