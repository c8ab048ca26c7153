#include "simulation/renderer.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <numeric>

#include "tests/simulation/flat_studio.h"

namespace weft {
namespace {

constexpr int kRows = 12, kCols = 16;

// OpenCV's formula, written down again.
Eigen::Vector2d PixelOf(const CameraModel& camera, const Eigen::Vector3d& world_mm) {
  const Eigen::Vector3d p = camera.rotation * world_mm + camera.translation_mm;
  const double x = p.x() / p.z(), y = p.y() / p.z(), r2 = x * x + y * y;
  const auto& k = camera.distortion;
  const double radial = (1 + k[0] * r2 + k[1] * r2 * r2 + k[4] * r2 * r2 * r2) /
                        (1 + k[5] * r2 + k[6] * r2 * r2 + k[7] * r2 * r2 * r2);
  const double u = x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x);
  const double v = y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y;
  return {camera.fx_px * u + camera.cx_px, camera.fy_px * v + camera.cy_px};
}

Eigen::Vector3d CellCenter(int row, int col) {
  return {(col + 0.5 - kCols / 2.0) * kFlatCellMm, (row + 0.5 - kRows / 2.0) * kFlatCellMm, 0};
}

TEST(Renderer, CellCentersHaveTheColorOfTheBoard) {
  const StudioScene scene = SceneOf(FlatSheet(kRows, kCols), PlainLook());
  for (const double angle_deg : {0.0, 35.0}) {
    const CameraModel camera = FlatCamera(1000, 300, angle_deg);
    const absl::StatusOr<LinearImage> image = TraceView(scene, camera, 2);
    ASSERT_TRUE(image.ok()) << image.status();
    for (int r = 0; r < kRows; ++r)
      for (int c = 0; c < kCols; ++c) {
        const Eigen::Vector2d pixel = PixelOf(camera, CellCenter(r, c));
        const float* seen =
            image->at(static_cast<int>(std::lround(pixel.x())), static_cast<int>(std::lround(pixel.y())));
        const Eigen::Vector3f ink = InkOptions().color[static_cast<size_t>(scene.board().at(r, c))];
        for (int i = 0; i < 3; ++i) EXPECT_NEAR(seen[i], ink[i], 1e-4) << r << ", " << c;
      }
  }
}

TEST(Renderer, SquaresAreCentredOnTheProjectionOfTheirCells) {
  const StudioScene scene = SceneOf(FlatSheet(kRows, kCols), PlainLook());
  CameraModel camera = FlatCamera(1200, 300, 0);  // 16 px a cell
  camera.distortion = {-0.3, 0.2, 0.002, -0.001, 0, 0, 0, 0};
  const absl::StatusOr<LinearImage> image = TraceView(scene, camera, 4);
  ASSERT_TRUE(image.ok()) << image.status();
  const Eigen::Vector3f line = InkOptions().line;
  double worst_px = 0;
  for (int r = 0; r < kRows; ++r)
    for (int c = 0; c < kCols; ++c) {
      // The ink lines around a square are black, so its centroid is that of the window between them.
      const Eigen::Vector2d pixel = PixelOf(camera, CellCenter(r, c));
      const auto x0 = static_cast<int>(std::lround(pixel.x())), y0 = static_cast<int>(std::lround(pixel.y()));
      double sum = 0;
      Eigen::Vector2d moment = Eigen::Vector2d::Zero();
      for (int y = y0 - 7; y <= y0 + 7; ++y)
        for (int x = x0 - 7; x <= x0 + 7; ++x) {
          const Eigen::Map<const Eigen::Vector3f> seen(image->at(x, y));
          const double light = (seen - line).sum();
          sum += light;
          moment += light * Eigen::Vector2d(x, y);
        }
      worst_px = std::max(worst_px, (moment / sum - pixel).norm());
    }
  EXPECT_LT(worst_px, 0.02);
}

TEST(Renderer, RaysAgreeWithTheLensModel) {
  // Where the picture shows board position (col, row), that place of the sheet projects to the pixel.
  const StudioScene scene = SceneOf(FlatSheet(kRows, kCols), PlainLook());
  CameraModel camera = FlatCamera(1000, 300, 25);
  camera.distortion = {-0.2, 0.1, 0.001, 0.002, 0, 0, 0, 0};
  int hits = 0;
  for (int y = 3; y < camera.height_px; y += 17)
    for (int x = 5; x < camera.width_px; x += 13) {
      const std::optional<Ray> ray = camera.PixelRay({x, y});
      ASSERT_TRUE(ray.has_value());
      const RayHit hit = scene.rays().Cast(ray->origin_mm.cast<float>(), ray->direction.cast<float>());
      if (hit.face < 0) continue;
      const auto& corners = scene.print().of_face[hit.face];
      const BoardPoint p = (1 - hit.weight_b - hit.weight_c) * corners[0] + hit.weight_b * corners[1] +
                           hit.weight_c * corners[2];
      const Eigen::Vector3d place((p.x() - kCols / 2.0) * kFlatCellMm, (p.y() - kRows / 2.0) * kFlatCellMm,
                                  0);
      EXPECT_LT((PixelOf(camera, place) - Eigen::Vector2d(x, y)).norm(), 0.005);
      ++hits;
    }
  EXPECT_GT(hits, 100);
}

LinearImage EvenImage(int width_px, int height_px, float light) {
  return {width_px, height_px, std::vector<float>(3 * static_cast<size_t>(width_px) * height_px, light)};
}

TEST(Renderer, BlurSpreadsAPointAsAGaussian) {
  LinearImage image = EvenImage(41, 41, 0);
  image.at(20, 20)[1] = 1;
  BlurImage(1.5, &image);
  double sum = 0, variance = 0;
  for (int y = 0; y < 41; ++y)
    for (int x = 0; x < 41; ++x) {
      sum += image.at(x, y)[1];
      variance += image.at(x, y)[1] * (x - 20) * (x - 20);
      EXPECT_EQ(image.at(x, y)[0], 0);
    }
  EXPECT_NEAR(sum, 1, 1e-5);
  EXPECT_NEAR(variance, 1.5 * 1.5, 0.01);
}

TEST(Renderer, NoiseFollowsTheNumberOfPhotons) {
  SensorOptions options;
  options.gamma = 1, options.exposure = 1;
  options.full_well_electrons = 1000, options.read_noise_electrons = 0;
  const Frame frame = DevelopImage(EvenImage(200, 200, 0.4f), options, "c", 0);
  double sum = 0, squares = 0;
  for (const uint8_t v : *frame.pixels) sum += v, squares += v * v;
  const auto n = static_cast<double>(frame.pixels->size());
  const double mean = sum / n, sigma = std::sqrt(squares / n - mean * mean);
  EXPECT_NEAR(mean, 0.4 * 255, 0.1);
  // 400 electrons: a standard deviation of 20 of 1000, plus that of rounding.
  EXPECT_NEAR(sigma, std::sqrt(std::pow(255 * 20 / 1000.0, 2) + 1 / 12.0), 0.05);
}

TEST(Renderer, MosaicTakesTheChannelOfItsPlace) {
  LinearImage image = EvenImage(4, 4, 0);
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 4; ++x) image.at(x, y)[0] = 0.2f, image.at(x, y)[1] = 0.4f, image.at(x, y)[2] = 0.8f;
  SensorOptions options;
  options.noise = false, options.gamma = 1, options.exposure = 1;
  options.mosaic = PixelFormat::kBayerRg8;
  const Frame frame = DevelopImage(image, options, "c", 0);
  ASSERT_TRUE(frame.Validate().ok());
  EXPECT_EQ(frame.row(0)[0], 51);   // red
  EXPECT_EQ(frame.row(0)[1], 102);  // green
  EXPECT_EQ(frame.row(1)[0], 102);
  EXPECT_EQ(frame.row(1)[1], 204);  // blue
}

TEST(Renderer, SamePictureAtAnyThreadCount) {
  const Cloth cloth = FlatSheet(kRows, kCols);
  const CameraModel camera = FlatCamera(900, 300, 40);
  const auto render = [&](int threads, uint64_t seed) {
    tbb::task_arena arena(threads);
    return arena.execute([&] {
      SensorOptions sensor;
      sensor.seed = seed;
      const absl::StatusOr<Frame> frame = RenderView(SceneOf(cloth, StudioOptions()), camera, sensor, 7);
      EXPECT_TRUE(frame.ok()) << frame.status();
      return *frame->pixels;
    });
  };
  const std::vector<uint8_t> one = render(1, 5);
  EXPECT_EQ(one, render(2, 5));
  EXPECT_NE(one, render(2, 6));
}

TEST(Renderer, OptionsOutOfRangeAreNamed) {
  SensorOptions sensor;
  sensor.exposure = 0;
  EXPECT_NE(sensor.Validate().message().find("exposure"), std::string::npos);
  sensor = SensorOptions();
  sensor.mosaic = PixelFormat::kRgb8;
  EXPECT_NE(sensor.Validate().message().find("mosaic"), std::string::npos);
}

}  // namespace
}  // namespace weft
