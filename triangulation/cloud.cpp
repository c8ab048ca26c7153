#include "triangulation/cloud.h"

namespace weft {

std::string_view RejectReasonName(RejectReason reason) {
  switch (reason) {
    case RejectReason::kTooFewViews:
      return "too_few_views";
    case RejectReason::kNoConsensus:
      return "no_consensus";
    case RejectReason::kPoorGeometry:
      return "poor_geometry";
    case RejectReason::kIsolated:
      return "isolated";
    case RejectReason::kStretchedEdges:
      return "stretched_edges";
    case RejectReason::kSmallComponent:
      return "small_component";
    case RejectReason::kUnconfirmed:
      return "unconfirmed";
  }
  return "unknown";
}

}  // namespace weft
