#include "simulation/renderer.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <vector>

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
    const absl::StatusOr<TracedView> view = TraceView(scene, camera);
    ASSERT_TRUE(view.ok()) << view.status();
    for (int r = 0; r < kRows; ++r)
      for (int c = 0; c < kCols; ++c) {
        const Eigen::Vector2d pixel = PixelOf(camera, CellCenter(r, c));
        const float* seen = view->image.at(static_cast<int>(std::lround(pixel.x())),
                                           static_cast<int>(std::lround(pixel.y())));
        const Eigen::Vector3f ink = InkOptions().color[static_cast<size_t>(scene.board().at(r, c))];
        for (int i = 0; i < 3; ++i) EXPECT_NEAR(seen[i], ink[i], 1e-4) << r << ", " << c;
      }
  }
}

TEST(Renderer, SquaresAreCentredOnTheProjectionOfTheirCells) {
  const StudioScene scene = SceneOf(FlatSheet(kRows, kCols), PlainLook());
  CameraModel camera = FlatCamera(1200, 300, 0);  // 16 px a cell
  camera.distortion = {-0.3, 0.2, 0.002, -0.001, 0, 0, 0, 0};
  const absl::StatusOr<TracedView> view = TraceView(scene, camera, {64});
  ASSERT_TRUE(view.ok()) << view.status();
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
          const Eigen::Map<const Eigen::Vector3f> seen(view->image.at(x, y));
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

TEST(Renderer, SamePictureAtAnyThreadCount) {
  const Cloth cloth = FlatSheet(kRows, kCols);
  const CameraModel camera = FlatCamera(900, 300, 40);
  const auto render = [&](int threads, uint64_t seed) {
    tbb::task_arena arena(threads);
    return arena.execute([&] {
      CameraOptions options;
      options.sensor.seed = seed;
      options.lens.f_number = 4, options.lens.vignetting = 0.1;
      const absl::StatusOr<StudioScene> scene =
          SceneOf(cloth, StudioOptions(), {200, 50, 30}).Exposed(0.001, 0.01);
      EXPECT_TRUE(scene.ok()) << scene.status();
      const absl::StatusOr<Picture> picture = RenderView(*scene, camera, options, 7);
      EXPECT_TRUE(picture.ok()) << picture.status();
      return picture->values;
    });
  };
  const std::vector<uint16_t> one = render(1, 5);
  EXPECT_EQ(one, render(2, 5));
  EXPECT_NE(one, render(2, 6));
}

// Where the brightness along a row crosses from the print to the room behind it: share of the sheet in each
// pixel, 1 inside.
std::vector<double> CoverAlongRow(const LinearImage& image, int y) {
  std::vector<double> out;
  for (int x = 0; x < image.width_px; ++x) out.push_back(image.at(x, y)[0]);
  return out;
}

// White all over, before a black room.
StudioOptions WhiteOnBlack() {
  StudioOptions look = PlainLook();
  look.inks.color.fill(Eigen::Vector3f::Ones());
  look.inks.line.setOnes();
  return look;
}

TEST(Renderer, EdgeOfAMovingSheetIsARampOfSpeedTimesExposure) {
  const CameraModel camera = FlatCamera(1000, 400, 0);  // 2.5 px per mm
  const StudioScene still = SceneOf(FlatSheet(kRows, kCols), WhiteOnBlack(), {800, 0, 0});
  const absl::StatusOr<StudioScene> scene = still.Exposed(0, 0.004);  // 3.2 mm, 8 px
  ASSERT_TRUE(scene.ok()) << scene.status();
  const absl::StatusOr<TracedView> view = TraceView(*scene, camera);
  ASSERT_TRUE(view.ok()) << view.status();
  const double edge_px = PixelOf(camera, {kCols * kFlatCellMm / 2, 0, 0}).x();
  const std::vector<double> cover = CoverAlongRow(view->image, 120);
  for (int x = 190; x < 310; ++x) {
    const double expected = std::clamp(0.5 - (x - edge_px) / 8, 0.0, 1.0);
    EXPECT_NEAR(cover[x], expected, 0.08) << x << " of " << edge_px;
  }
}

TEST(Renderer, PrintOfAMovingSheetIsTheMeanOfItsPlacesDuringTheExposure) {
  const CameraModel camera = FlatCamera(1000, 300, 20);
  const StudioScene still = SceneOf(FlatSheet(kRows, kCols), PlainLook(), {600, 300, -200});
  constexpr double kExposureS = 0.006;
  const absl::StatusOr<StudioScene> moving = still.Exposed(0, kExposureS);
  ASSERT_TRUE(moving.ok()) << moving.status();
  const absl::StatusOr<TracedView> blurred = TraceView(*moving, camera, {16});
  ASSERT_TRUE(blurred.ok()) << blurred.status();
  constexpr int kMoments = 24;
  std::vector<double> mean(blurred->image.rgb.size());
  for (int k = 0; k < kMoments; ++k) {
    const absl::StatusOr<StudioScene> moment = still.Exposed(kExposureS * ((k + 0.5) / kMoments - 0.5), 0);
    ASSERT_TRUE(moment.ok()) << moment.status();
    const absl::StatusOr<TracedView> view = TraceView(*moment, camera, {16});
    ASSERT_TRUE(view.ok()) << view.status();
    for (size_t i = 0; i < mean.size(); ++i) mean[i] += view->image.rgb[i] / kMoments;
  }
  double squares = 0, change = 0;
  const absl::StatusOr<TracedView> frozen = TraceView(still, camera, {16});
  ASSERT_TRUE(frozen.ok()) << frozen.status();
  for (size_t i = 0; i < mean.size(); ++i) {
    squares += std::pow(blurred->image.rgb[i] - mean[i], 2);
    change += std::pow(frozen->image.rgb[i] - mean[i], 2);
  }
  EXPECT_LT(std::sqrt(squares / change), 0.12);
}

TEST(Renderer, EvenSurfacesLookAsWhenEverySampleIsARay) {
  // A tilted sheet, sampled pixel by pixel on its faces; against it the mean of rays cast one by one.
  const StudioScene scene = SceneOf(FlatSheet(kRows, kCols), PlainLook());
  const CameraModel camera = FlatCamera(500, 300, 55);
  const absl::StatusOr<TracedView> view = TraceView(scene, camera, {16});
  ASSERT_TRUE(view.ok()) << view.status();
  constexpr int kAxis = 12;
  double worst = 0;
  for (int y = 10; y < camera.height_px; y += 23)
    for (int x = 7; x < camera.width_px; x += 19) {
      Eigen::Vector3f mean = Eigen::Vector3f::Zero();
      bool inside = true;
      for (int k = 0; k < kAxis * kAxis; ++k) {
        const auto ray = camera.PixelRay(
            {x - 0.5 + (k % kAxis + 0.5) / kAxis, y - 0.5 + (static_cast<double>(k / kAxis) + 0.5) / kAxis});
        ASSERT_TRUE(ray.has_value());
        const RayHit hit = scene.rays().Cast(ray->origin_mm.cast<float>(), ray->direction.cast<float>());
        inside = inside && hit.face >= 0;
        if (!inside) break;
        const ShadedPoint point =
            scene.ShadeAt(hit.face, true, {1 - hit.weight_b - hit.weight_c, hit.weight_b, hit.weight_c});
        mean += point.light * scene.ink().At(point.board.x(), point.board.y()) / (kAxis * kAxis);
      }
      if (!inside) continue;
      const Eigen::Map<const Eigen::Vector3f> seen(view->image.at(x, y));
      worst = std::max<double>(worst, (seen - mean).cwiseAbs().maxCoeff());
    }
  EXPECT_LT(worst, 0.03);
}

TEST(Renderer, LensBlursWhatIsOutOfFocusByThinLensAndPointSpread) {
  const StudioScene scene = SceneOf(FlatSheet(kRows, kCols), WhiteOnBlack());
  const CameraModel camera = FlatCamera(1000, 400, 0);
  CameraOptions options;
  options.sensor.noise = false, options.sensor.gamma = 1, options.sensor.exposure = 0.9;
  options.sensor.readout = Readout::kBinned, options.sensor.bits = 12;
  options.lens.point_spread_sigma_px = 1.5;
  options.lens.f_number = 2.8, options.lens.focus_distance_mm = 200;
  const absl::StatusOr<Picture> picture = RenderView(scene, camera, options, 0);
  ASSERT_TRUE(picture.ok()) << picture.status();
  // The spread of the edge's derivative: pixel and Gaussian and disc (R^2 / 4) add up.
  const double edge_px = PixelOf(camera, {kCols * kFlatCellMm / 2, 0, 0}).x();
  double weight = 0, moment = 0;
  for (int x = 200; x < 300; ++x) {
    const auto value = [&](int at) {
      return static_cast<double>(picture->values[3 * (120 * static_cast<size_t>(picture->width_px) + at)]);
    };
    const double drop = value(x) - value(x + 1);
    weight += drop;
    moment += drop * std::pow(x + 0.5 - edge_px, 2);
  }
  // f = 3.45 mm at f/2.8.
  const double radius_px = 3.45 * 3.45 * 200 / (2 * 2.8 * 400 * (200 - 3.45)) / 0.00345;
  EXPECT_NEAR(DefocusRadiusPx(options.lens, 1000, 200, 400), radius_px, 1e-9);
  EXPECT_NEAR(radius_px, 1.57, 0.01);
  EXPECT_NEAR(moment / weight, 1.5 * 1.5 + radius_px * radius_px / 4 + 2.0 / 12, 0.1);
}

TEST(Renderer, TimeOffsetMovesTheSheetByItsVelocity) {
  const StudioScene scene = SceneOf(FlatSheet(kRows, kCols), PlainLook(), {100, -40, 20});
  const absl::StatusOr<StudioScene> later = scene.Exposed(0.01, 0.002);
  ASSERT_TRUE(later.ok()) << later.status();
  for (size_t v = 0; v < scene.mesh().vertices_mm.size(); ++v)
    EXPECT_LT(
        (later->mesh().vertices_mm[v] - scene.mesh().vertices_mm[v] - Eigen::Vector3d(1, -0.4, 0.2)).norm(),
        1e-9);
}

}  // namespace
}  // namespace weft
