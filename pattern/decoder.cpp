#include "pattern/decoder.h"

#include <memory>

#include "base/status_macros.h"
#include "pattern/view_decoder.h"

namespace weft {

absl::Status ConfidenceOptions::Validate() const {
  const auto is_share = [](float confidence) { return confidence >= 0 && confidence < 1; };
  if (!is_share(min_to_grow)) return absl::InvalidArgumentError("confidence.min_to_grow must lie in [0, 1)");
  if (!is_share(min_at_boundary)) {
    return absl::InvalidArgumentError("confidence.min_at_boundary must lie in [0, 1)");
  }
  if (!is_share(min_to_help)) return absl::InvalidArgumentError("confidence.min_to_help must lie in [0, 1)");
  if (!is_share(min_to_stay)) return absl::InvalidArgumentError("confidence.min_to_stay must lie in [0, 1)");
  if (min_component < 1) return absl::InvalidArgumentError("confidence.min_component must be at least 1");
  return absl::OkStatus();
}

absl::Status DecodeOptions::Validate() const {
  if (levels < 1 || levels > 8) return absl::InvalidArgumentError("levels must lie in 1 to 8");
  for (const absl::Status& status : {keypoints.Validate(), lattice.Validate(), patches.Validate(),
                                     growth.Validate(), isolated.Validate(), confidence.Validate()}) {
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::StatusOr<DecodeResult> DecodeView(const Frame& frame, const BoardIndex& board,
                                        const DecodeOptions& options) {
  WEFT_ASSIGN_OR_RETURN(const std::unique_ptr<ViewDecoder> view, ViewDecoder::Read(frame, board, options));
  view->Decode();
  return view->TakeResult();
}

}  // namespace weft
