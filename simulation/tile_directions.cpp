#include "simulation/tile_directions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

namespace weft {
namespace {

// Lagrange's weights of the values at -1, 0, 1, 2 for a place t between 0 and 1.
std::array<float, 4> CubicWeights(float t) {
  return {-t * (t - 1) * (t - 2) / 6, (t + 1) * (t - 1) * (t - 2) / 2, -(t + 1) * t * (t - 2) / 2,
          (t + 1) * t * (t - 1) / 6};
}

}  // namespace

TileDirections::TileDirections(const CameraModel& camera, int x0, int y0)
    : camera_(camera), x0_(x0), y0_(y0), nodes_(kNodes * kNodes) {
  for (int j = 0; j < kNodes; ++j)
    for (int i = 0; i < kNodes; ++i) {
      nodes_[j * kNodes + i] = Exact((i - 1) * kSpacing, (j - 1) * kSpacing);
      complete_ = complete_ && !std::isnan(nodes_[j * kNodes + i].x());
    }
}

Eigen::Vector2f TileDirections::Exact(int x, int y) const {
  const std::optional<Eigen::Vector2d> p = camera_.Undistort(Eigen::Vector2d(x0_ + x, y0_ + y));
  if (!p) return Eigen::Vector2f::Constant(std::numeric_limits<float>::quiet_NaN());
  return p->cast<float>();
}

void TileDirections::Row(int y, int step, std::vector<Eigen::Vector2f>* out) const {
  const int end = step == 1 ? kTile : kTile + 1;
  if (!complete_) {
    for (int x = 0; x < end; x += step) out->push_back(Exact(x, y));
    return;
  }
  const auto share = [](int k) { return static_cast<float>(k % kSpacing) / kSpacing; };
  std::array<Eigen::Vector2f, kNodes> column;
  const std::array<float, 4> down = CubicWeights(share(y));
  // The last point of all ends a segment; its weights are 1 for the node itself.
  const auto first_node = [&](int k) { return std::min(k / kSpacing, kNodes - 4); };
  const int row = first_node(y);
  const bool last_row = y == kTile;
  for (int i = 0; i < kNodes; ++i) {
    column[i].setZero();
    for (int k = 0; k < 4; ++k) column[i] += down[k] * nodes_[(row + k) * kNodes + i];
    if (last_row) column[i] = nodes_[(kNodes - 2) * kNodes + i];
  }
  for (int x = 0; x < end; x += step) {
    if (x == kTile) {
      out->push_back(column[kNodes - 2]);
      continue;
    }
    const std::array<float, 4> across = CubicWeights(share(x));
    const Eigen::Vector2f* const at = &column[first_node(x)];
    out->push_back(across[0] * at[0] + across[1] * at[1] + across[2] * at[2] + across[3] * at[3]);
  }
}

std::vector<Eigen::Vector2f> TileDirections::All() const {
  std::vector<Eigen::Vector2f> out;
  out.reserve(kTile * kTile);
  for (int y = 0; y < kTile; ++y) Row(y, 1, &out);
  return out;
}

std::vector<Eigen::Vector2f> TileDirections::Every(int step) const {
  std::vector<Eigen::Vector2f> out;
  for (int y = 0; y <= kTile; y += step) Row(y, step, &out);
  return out;
}

// The nodes reach a spacing beyond the tile, so they hold its directions unless some are missing.
Eigen::AlignedBox2f TileDirections::Bounds() const {
  Eigen::AlignedBox2f box;
  if (complete_) {
    for (const Eigen::Vector2f& d : nodes_) box.extend(d);
    return box;
  }
  for (const Eigen::Vector2f& d : All())
    if (!std::isnan(d.x())) box.extend(d);
  return box;
}

}  // namespace weft
