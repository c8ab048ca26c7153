// The room as it is seen behind a tile of a picture.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "simulation/studio_room.h"
#include "simulation/tile_directions.h"

namespace weft {

// Looked at every few pixels, and interpolated where it is even between them; the room's outlines are softer
// than that. Keeps references.
class TileRoom {
 public:
  TileRoom(const StudioRoom& room, const TileDirections& directions, const Eigen::Vector3f& eye_mm,
           const Eigen::Matrix3f& world_from_camera);

  // Light in a pixel of the tile.
  Eigen::Vector3f At(int x, int y) const;
  // Light from a direction (x, y, 1) in camera axes; of the optical axis where it is NaN.
  Eigen::Vector3f In(const Eigen::Vector2f& direction) const;

 private:
  static constexpr int kBlock = 4;  // pixels from one look to the next
  static constexpr int kBlocks = TileDirections::kTile / kBlock;

  const StudioRoom& room_;
  const TileDirections& directions_;
  Eigen::Vector3f eye_mm_;
  Eigen::Matrix3f world_from_camera_;
  std::vector<Eigen::Vector3f> light_;        // [(kBlocks + 1)^2], at the corners of the blocks
  std::array<bool, kBlocks * kBlocks> even_;  // between the four corners
};

}  // namespace weft
