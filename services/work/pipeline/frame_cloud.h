// From the images of a frame set to its cloud: decode every view, triangulate, clean.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/rig/rig.h"
#include "capture/take/frame_source.h"
#include "pattern/board/board_index.h"
#include "pattern/view_decoder.h"
#include "services/formats/options/pipeline_options.h"
#include "services/work/pipeline/algorithm_versions.h"
#include "triangulation/cloud.h"
#include "triangulation/triangulate.h"
#include "weft/v1/report.pb.h"

namespace weft {

// Called with the share of the work that is done, 0 to 1, from any thread of the arena.
using FrameProgress = std::function<void(double share)>;

// The images of one frame set, and what they show.
struct FrameImages {
  const Rig& rig;
  const BoardIndex& board;
  const FrameSource& dump;
  size_t index;  // of the frame
};

// Views and reports have an entry per camera of the rig, in its order. A view whose image is missing or
// broken has no observations, and its report says why.
struct DecodedFrame {
  std::vector<ViewObservations> views;
  std::vector<v1::ViewReport> reports;
  // For a second pass; null for views without a usable image, and where there is no second pass. Images
  // beyond the limit were dropped.
  std::vector<std::unique_ptr<ViewDecoder>> decoders;
};

// Decodes them in the calling thread's TBB arena. Once `stop` is requested the
// remaining views stay empty. Images are kept for a second pass up to `kept_image_bytes` in all; none: there
// is no second pass.
DecodedFrame DecodeFrame(Computes<Stage::kDecode>, const FrameImages& images, const DecodeOptions& options,
                         std::optional<size_t> kept_image_bytes, const FrameProgress& progress,
                         const std::stop_token& stop);

// The nodes where the views' observations meet, cleaned, with centres sharpened where cloth bends.
// `camera_sigma_px`: what the calibration leaves, per camera of the rig; may be empty. InvalidArgument as
// Triangulate.
absl::StatusOr<Cloud> TriangulateFrame(Computes<Stage::kTriangulate>, const Rig& rig,
                                       const std::vector<double>& camera_sigma_px,
                                       const std::vector<ViewObservations>& views,
                                       const CloudOptions& options);

// The reason, for the operator, why nothing could be triangulated from these views. `reports` of the same
// cameras say which of them have no image, and why. `min_views`: ConsensusOptions.
std::string NoCloudReason(const std::vector<ViewObservations>& views,
                          const std::vector<v1::ViewReport>& reports, int min_views);

}  // namespace weft
