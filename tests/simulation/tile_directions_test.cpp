#include "simulation/tile_directions.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace weft {
namespace {

CameraModel PinholeOfTile() {
  CameraModel camera;
  camera.width_px = 640;
  camera.height_px = 480;
  camera.fx_px = 500;
  camera.fy_px = 400;
  camera.cx_px = 320;
  camera.cy_px = 240;
  return camera;
}

// Without a lens, directions are linear in pixels.
TEST(TileDirections, OfAPinholeAreItsRays) {
  const CameraModel camera = PinholeOfTile();
  const TileDirections tile(camera, 128, 64);
  const std::vector<Eigen::Vector2f> all = tile.All();
  ASSERT_EQ(all.size(), 64u * 64u);
  for (const int y : {0, 15, 16, 63}) {
    for (const int x : {0, 1, 31, 63}) {
      const Eigen::Vector2f expected((128 + x - 320) / 500.0f, (64 + y - 240) / 400.0f);
      EXPECT_LT((all[64 * y + x] - expected).norm(), 3e-6f) << x << " " << y;
      EXPECT_LT((tile.Exact(x, y) - expected).norm(), 3e-6f);
    }
  }
}

TEST(TileDirections, OfEveryFewPixelsHaveTheOneBehindTheLast) {
  const CameraModel camera = PinholeOfTile();
  const std::vector<Eigen::Vector2f> some = TileDirections(camera, 0, 0).Every(16);
  ASSERT_EQ(some.size(), 25u);
  EXPECT_LT((some.back() - Eigen::Vector2f((64 - 320) / 500.0f, (64 - 240) / 400.0f)).norm(), 3e-6f);
}

TEST(TileDirections, AreWithinTheirBounds) {
  const CameraModel camera = PinholeOfTile();
  const TileDirections tile(camera, 0, 0);
  const Eigen::AlignedBox2f bounds = tile.Bounds();
  for (const Eigen::Vector2f& direction : tile.All()) ASSERT_TRUE(bounds.contains(direction));
}

}  // namespace
}  // namespace weft
