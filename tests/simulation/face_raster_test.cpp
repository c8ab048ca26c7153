#include "simulation/face_raster.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "simulation/random.h"
#include "simulation/tile_directions.h"

namespace weft {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr int kTile = TileDirections::kTile;

CameraModel WideCamera() {
  CameraModel camera;
  camera.id = "c";
  camera.width_px = kTile, camera.height_px = kTile;
  camera.fx_px = 60, camera.fy_px = 62, camera.cx_px = 30, camera.cy_px = 34;
  camera.distortion = {-0.12, 0.03, 0.002, -0.001, 0, 0, 0, 0};
  return camera;
}

struct Soup {
  std::vector<Vector3f> corners;
  std::vector<Face> faces;
  std::vector<Vector3f> paths;
};

// Faces all over the view, some beside and behind the camera.
Soup RandomSoup(int count) {
  Soup out;
  const auto random = [](uint64_t k) { return static_cast<float>(2 * UniformOf(5, k) - 1); };
  for (int f = 0; f < count; ++f) {
    const uint64_t k = 100 * static_cast<uint64_t>(f);
    const Vector3f middle(150 * random(k), 150 * random(k + 1), 120 + 140 * random(k + 2));
    const Vector3f path = 4 * Vector3f(random(k + 30), random(k + 31), random(k + 32));
    for (uint64_t c = 0; c < 3; ++c) {
      out.corners.push_back(
          middle + 30 * Vector3f(random(k + 3 + 3 * c), random(k + 4 + 3 * c), random(k + 5 + 3 * c)));
      out.paths.push_back(path);
    }
    out.faces.push_back({3 * f, 3 * f + 1, 3 * f + 2});
  }
  return out;
}

// The plain way: every ray against every face. Ray (x, y, 1) from the origin.
RayHit NearestOf(const Soup& soup, float share, const Vector2f& direction) {
  RayHit best;
  const Eigen::Vector3d ray = direction.homogeneous().cast<double>();
  for (size_t f = 0; f < soup.faces.size(); ++f) {
    Eigen::Matrix3d corners;
    for (int i = 0; i < 3; ++i)
      corners.col(i) = (soup.corners[3 * f + i] + share * soup.paths[3 * f + i]).cast<double>();
    const Eigen::Vector3d weights = corners.inverse() * ray;  // ray = sum of weight times corner
    const double sum = weights.sum();
    if (!(sum > 0) || weights.minCoeff() < 0) continue;
    if (1 / sum < best.distance_mm)
      best = {static_cast<int>(f), static_cast<float>(1 / sum), static_cast<float>(weights[1] / sum),
              static_cast<float>(weights[2] / sum), false};
  }
  return best;
}

// Rays that pass an outline by less than rounding may end on either side.
void ExpectAlike(int rays, int differing) {
  EXPECT_GT(rays, 1000);
  EXPECT_LE(differing, rays / 1000);
}

TEST(FaceRaster, DrawsWhatRaysMeet) {
  const Soup soup = RandomSoup(150);
  const TileDirections tile(WideCamera(), 0, 0);
  const std::vector<Vector2f> directions = tile.All();
  const FaceRaster raster(soup.corners, soup.faces, tile.Bounds());
  const std::vector<int> faces = raster.FacesIn(tile.Bounds());
  std::vector<RayHit> hits;
  raster.Draw(faces, directions, kTile, &hits);
  int met = 0, differing = 0;
  for (size_t p = 0; p < directions.size(); ++p) {
    const RayHit expected = NearestOf(soup, 0, directions[p]);
    const int face = hits[p].face < 0 ? -1 : faces[hits[p].face];
    met += expected.face >= 0 ? 1 : 0;
    if (face != expected.face) {
      ++differing;
      continue;
    }
    if (face < 0) continue;
    EXPECT_NEAR(hits[p].distance_mm, expected.distance_mm, 1e-3 * expected.distance_mm);
    EXPECT_NEAR(hits[p].weight_b, expected.weight_b, 2e-3);
    EXPECT_NEAR(hits[p].weight_c, expected.weight_c, 2e-3);
  }
  ExpectAlike(met, differing);
}

TEST(FaceRaster, SamplesMeetFacesWhereTheyAreAtTheirMoments) {
  const Soup soup = RandomSoup(150);
  const TileDirections tile(WideCamera(), 0, 0);
  const std::vector<Vector2f> directions = tile.All();
  const FaceRaster raster(soup.corners, soup.faces, tile.Bounds());
  const std::vector<int> faces = raster.FacesIn(tile.Bounds());
  RaySamples samples;
  for (int k = 0; k < RaySamples::kCount; ++k) {
    samples.offset[k] = Vector2f(static_cast<float>(k % 4) - 1.5f, static_cast<float>(k / 4) - 1.5f) / 400;
    samples.moment[k] = (static_cast<float>(k * 7 % RaySamples::kCount) + 0.5f) / RaySamples::kCount - 0.5f;
  }
  std::vector<int> slot_of_pixel(directions.size(), -1), pixels;
  for (int p = 5; p < kTile * kTile; p += 11) {
    slot_of_pixel[p] = static_cast<int>(pixels.size());
    pixels.push_back(p);
  }
  std::vector<RayHit> hits;
  raster.DrawSamples(faces, directions, kTile, slot_of_pixel, samples, soup.paths, &hits);
  ASSERT_EQ(hits.size(), pixels.size() * RaySamples::kCount);
  int met = 0, differing = 0;
  for (size_t i = 0; i < hits.size(); ++i) {
    const size_t k = i % RaySamples::kCount;
    const Vector2f direction = directions[pixels[i / RaySamples::kCount]] + samples.offset[k];
    const RayHit expected = NearestOf(soup, samples.moment[k], direction);
    const int face = hits[i].face < 0 ? -1 : faces[hits[i].face];
    met += expected.face >= 0 ? 1 : 0;
    differing += face != expected.face ? 1 : 0;
  }
  ExpectAlike(met, differing);
}

TEST(TileDirections, AreTheLensModelsToAThousandthOfAPixel) {
  CameraModel camera = WideCamera();
  camera.width_px = 640, camera.height_px = 480;
  camera.fx_px = 500, camera.fy_px = 505, camera.cx_px = 330, camera.cy_px = 250;
  const TileDirections tile(camera, -7, 11);
  const std::vector<Vector2f> all = tile.All(), some = tile.Every(4);
  constexpr int kAcross = kTile / 4 + 1;
  for (int y = 0; y < kTile; y += 3)
    for (int x = 0; x < kTile; x += 3) {
      const auto exact = camera.Undistort(Eigen::Vector2d(x - 7, y + 11));
      ASSERT_TRUE(exact.has_value());
      EXPECT_LT(camera.fx_px * (all[y * kTile + x].cast<double>() - *exact).norm(), 1e-3);
    }
  for (int j = 0; j < kAcross; ++j)
    for (int i = 0; i < kAcross; ++i) {
      const auto exact = camera.Undistort(Eigen::Vector2d(4 * i - 7, 4 * j + 11));
      EXPECT_LT(camera.fx_px * (some[j * kAcross + i].cast<double>() - *exact).norm(), 1e-3);
    }
}

TEST(TileDirections, AreUnknownWhereTheLensModelHasNoInverse) {
  CameraModel camera = WideCamera();
  camera.distortion = {-0.5, 0, 0, 0, 0, 0, 0, 0};  // folds back 0.82 from the axis
  const std::vector<Vector2f> all = TileDirections(camera, 0, 0).All();
  for (int y = 0; y < kTile; y += 9)
    for (int x = 0; x < kTile; x += 9)
      EXPECT_EQ(std::isnan(all[y * kTile + x].x()), !camera.Undistort(Eigen::Vector2d(x, y)).has_value());
}

}  // namespace
}  // namespace weft
