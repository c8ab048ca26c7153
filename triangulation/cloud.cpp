#include "triangulation/cloud.h"

#include <algorithm>
#include <tuple>

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

const CloudPoint* FindPoint(const Cloud& cloud, const BoardNode& node) {
  const auto key = [](const BoardNode& n) { return std::tuple(n.kind, n.row, n.col); };
  const auto at =
      std::lower_bound(cloud.points.begin(), cloud.points.end(), node,
                       [&](const CloudPoint& p, const BoardNode& n) { return key(p.node) < key(n); });
  return at != cloud.points.end() && at->node == node ? &*at : nullptr;
}

}  // namespace weft
