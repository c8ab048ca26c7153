// Triangulation by the plain functions, ray by ray in doubles: what the kernels must agree with.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "triangulation/consensus.h"
#include "triangulation/node_index.h"
#include "triangulation/refine.h"
#include "triangulation/sight.h"

namespace weft::testing {

struct PlainPoint {
  RefinedPoint point;
  int views = 0;
};

// Nodes that at least min_views cameras agree on; covariances without the frame's variance factor.
inline std::optional<PlainPoint> PlainSolve(const std::vector<Sight>& sights, const BoardNode& node,
                                            const TriangulationOptions& options) {
  const uint64_t seed =
      options.consensus.seed ^ (static_cast<uint64_t>(node.kind) << 56 |
                                static_cast<uint64_t>(node.row) << 28 | static_cast<uint64_t>(node.col));
  if (DistinctCameras(sights) < options.consensus.min_views) return std::nullopt;
  Consensus consensus = FindConsensus(sights, options.consensus, seed);
  if (consensus.inliers.empty()) return std::nullopt;
  std::vector<int> inliers = consensus.inliers, next;
  Eigen::Vector3d start = consensus.position_mm;
  std::optional<RefinedPoint> point;
  for (int round = 0; round < 4; ++round) {
    point = RefinePoint(start, sights, inliers, options.refinement);
    if (!point) return std::nullopt;
    InliersAt(point->position_mm, sights, options.consensus, &next);
    if (static_cast<int>(next.size()) < options.consensus.min_views) return std::nullopt;
    if (next == inliers) break;
    inliers.swap(next);
    start = point->position_mm;
  }
  return PlainPoint{*point, static_cast<int>(inliers.size())};
}

inline std::map<BoardNode, PlainPoint> PlainTriangulate(const Rig& rig,
                                                        const std::vector<ViewObservations>& views,
                                                        const TriangulationOptions& options) {
  std::vector<std::vector<UndistortedPoint>> undistorted;
  for (const ViewObservations& view : views)
    undistorted.push_back(UndistortAll(rig.cameras[view.camera], view.observations));
  const NodeIndex index = GroupByNode(views);
  std::map<BoardNode, PlainPoint> points;
  for (const SeenNode& node : index.nodes) {
    std::vector<Sight> sights;
    for (size_t e = node.first; e < node.last; ++e) {
      const auto [view, place] = index.entries[e];
      if (!undistorted[view][place].valid) continue;
      const int camera = views[view].camera;
      sights.push_back(MakeSight(rig.cameras[camera], camera, undistorted[view][place],
                                 views[view].observations[place].sigma_px));
    }
    if (const auto point = PlainSolve(sights, node.node, options)) points[node.node] = *point;
  }
  return points;
}

}  // namespace weft::testing
