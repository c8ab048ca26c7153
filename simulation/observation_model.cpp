#include "simulation/observation_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>

#include "base/counter_random.h"

namespace weft {
namespace {

// Fitted to the first and middle frame of `weft simulate --preset shirt-drive --seed 5 --cameras 6 --frames 2
// --out drive-5`, held out: `--preset shirt-drive-jitter --seed 6 --cameras 4 --frames 2 --out drive-6`, by
// `refit_decode observation drive-5 --held-out drive-6`, which prints these lines.
constexpr std::array<double, 1 + kSightRegressors> kFoundLogOdds = {6.387,  -1.161, -6.807, 0.788,
                                                                    -4.418, -1.962, -0.960};
constexpr std::array<double, 1 + kSightRegressors> kLogSigmaPx = {-2.904, 1.517, 1.783, 0.305,
                                                                  0.787,  0.281, 0.167};

// The squares must not say anything about cells beyond those that were fitted.
constexpr double kLeastPitchPx = 2, kMostPitchPx = 8;

double Apply(const std::array<double, 1 + kSightRegressors>& weights, const CellSight& sight) {
  const std::array<double, kSightRegressors> x = RegressorsOf(sight);
  double out = weights[0];
  for (size_t k = 0; k < x.size(); ++k) out += weights[k + 1] * x[k];
  return out;
}

}  // namespace

SeenCells SightsOf(const ViewTruth& view) {
  std::set<std::pair<int, int>> visible;
  for (const NodeTruth& node : view.nodes)
    if (node.visible && node.node.kind == NodeKind::kCenter) visible.emplace(node.node.row, node.node.col);
  const auto is_whole = [&](const BoardNode& node, int ring) {
    for (int k = -ring; k <= ring; ++k)
      for (const auto& [row, col] : {std::pair(node.row - ring, node.col + k),
                                     {node.row + ring, node.col + k},
                                     {node.row + k, node.col - ring},
                                     {node.row + k, node.col + ring}})
        if (!visible.contains({row, col})) return false;
    return true;
  };
  SeenCells out;
  for (size_t k = 0; k < view.nodes.size(); ++k) {
    const NodeTruth& node = view.nodes[k];
    if (!node.visible || node.node.kind != NodeKind::kCenter) continue;
    int edge = 1;
    while (edge < CellSight::kFarFromEdge && is_whole(node.node, edge)) ++edge;
    out.at.push_back(k);
    out.sight.push_back({node.pitch_px, node.facing_deg, edge});
  }
  return out;
}

std::array<double, kSightRegressors> RegressorsOf(const CellSight& sight) {
  const double size = std::log(std::clamp(sight.pitch_px, kLeastPitchPx, kMostPitchPx) / 8),
               slant = sight.facing_deg / 60;
  return {size,
          size * size,
          slant * slant,
          sight.edge_cells == 1 ? 1.0 : 0.0,
          sight.edge_cells == 2 ? 1.0 : 0.0,
          sight.edge_cells == 3 ? 1.0 : 0.0};
}

double FoundProbability(const CellSight& sight) { return 1 / (1 + std::exp(-Apply(kFoundLogOdds, sight))); }

double ErrorSigmaPx(const CellSight& sight) { return std::exp(Apply(kLogSigmaPx, sight)); }

std::vector<Observation> ImitateDecoder(const ViewTruth& view, uint64_t seed) {
  const uint64_t key = KeyOf(seed, "observation " + view.camera_id);
  const SeenCells cells = SightsOf(view);
  std::vector<Observation> out;
  for (size_t k = 0; k < cells.at.size(); ++k) {
    const NodeTruth& node = view.nodes[cells.at[k]];
    // By the cell, so that others' visibility changes nothing.
    const uint64_t of_cell = MixBits(
        key ^ MixBits((static_cast<uint64_t>(node.node.row) << 32) ^ static_cast<uint32_t>(node.node.col)));
    const double found = FoundProbability(cells.sight[k]);
    if (UniformOf(of_cell, 0) >= found) continue;
    const double sigma = ErrorSigmaPx(cells.sight[k]);
    Observation seen;
    seen.x_px = node.pixel_px.x() + sigma * NormalOf(of_cell, 1);
    seen.y_px = node.pixel_px.y() + sigma * NormalOf(of_cell, 2);
    seen.node = node.node;
    seen.sigma_px = static_cast<float>(sigma);
    seen.confidence = 1;
    out.push_back(seen);
  }
  return out;
}

}  // namespace weft
