#include "simulation/tile_room.h"

#include <cmath>

namespace weft {
namespace {

constexpr float kEven = 0.03f;  // difference of the light up to which it is interpolated, relative

}  // namespace

TileRoom::TileRoom(const StudioRoom& room, const TileDirections& directions, const Eigen::Vector3f& eye_mm,
                   const Eigen::Matrix3f& world_from_camera)
    : room_(room), directions_(directions), eye_mm_(eye_mm), world_from_camera_(world_from_camera) {
  for (const Eigen::Vector2f& d : directions.Every(kBlock)) light_.push_back(In(d));
  constexpr int kDown = kBlocks + 1;
  for (int y = 0; y < kBlocks; ++y)
    for (int x = 0; x < kBlocks; ++x) {
      const Eigen::Vector3f* const at = &light_[y * kDown + x];
      const Eigen::Array3f low = at[0].cwiseMin(at[1]).cwiseMin(at[kDown]).cwiseMin(at[kDown + 1]);
      const Eigen::Array3f high = at[0].cwiseMax(at[1]).cwiseMax(at[kDown]).cwiseMax(at[kDown + 1]);
      even_[y * kBlocks + x] = ((high - low) <= kEven * high).all();
    }
}

Eigen::Vector3f TileRoom::At(int x, int y) const {
  const int bx = x / kBlock, by = y / kBlock;
  if (!even_[by * kBlocks + bx]) return In(directions_.Exact(x, y));
  constexpr int kDown = kBlocks + 1;
  const Eigen::Vector3f* const at = &light_[by * kDown + bx];
  const float u = static_cast<float>(x % kBlock) / kBlock, v = static_cast<float>(y % kBlock) / kBlock;
  return (1 - v) * ((1 - u) * at[0] + u * at[1]) + v * ((1 - u) * at[kDown] + u * at[kDown + 1]);
}

Eigen::Vector3f TileRoom::In(const Eigen::Vector2f& direction) const {
  if (std::isnan(direction.x())) return room_.See(eye_mm_, world_from_camera_.col(2));
  return room_.See(eye_mm_, (world_from_camera_ * direction.homogeneous()).normalized());
}

}  // namespace weft
