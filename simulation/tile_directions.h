// Where the pixels of a tile of a picture look.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "capture/rig/camera_model.h"

namespace weft {

// Directions (x, y, 1) in camera axes through the centres of the pixels of a square tile, which may reach
// beyond the picture. Interpolated by cubics between points 16 pixels apart, with real lenses within a
// thousandth of a pixel; NaN where the lens model has no inverse.
class TileDirections {
 public:
  static constexpr int kTile = 64;  // pixels on each side

  TileDirections(const CameraModel& camera, int x0, int y0);

  // Of one pixel of the tile, not interpolated.
  Eigen::Vector2f Exact(int x, int y) const;
  // [kTile * kTile], row by row.
  std::vector<Eigen::Vector2f> All() const;
  // At every `step`-th pixel in both ways, the one behind the last included: [kTile / step + 1]^2.
  std::vector<Eigen::Vector2f> Every(int step) const;

  // Holds all directions of the tile; empty where none is known.
  Eigen::AlignedBox2f Bounds() const;

 private:
  static constexpr int kSpacing = 16;
  static constexpr int kNodes = kTile / kSpacing + 3;  // one more on each side than segments have ends

  void Row(int y, int step, std::vector<Eigen::Vector2f>* out) const;

  const CameraModel& camera_;
  int x0_, y0_;
  bool complete_ = true;
  std::vector<Eigen::Vector2f> nodes_;  // [kNodes * kNodes]
};

}  // namespace weft
