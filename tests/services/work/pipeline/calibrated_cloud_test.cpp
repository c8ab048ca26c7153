// Clouds of rigs that were calibrated from few noisy boards: what rig.json knows of its own errors must reach
// the covariance of the points.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <random>

#include "services/formats/files/rig_file.h"
#include "services/work/pipeline/frame_cloud.h"
#include "tests/capture/calibration/simulated_calibration.h"

namespace weft {
namespace {

constexpr double kPixelSigma = 0.05;
constexpr int kRows = 30, kCols = 90;

// A board laid around the stage as a garment is; calibration errors turn and shift a small cloth as a whole.
Eigen::Vector3d Place(int row, int col) {
  const double angle = 2 * M_PI * col / kCols;
  return {175 * std::sin(angle), (row - 0.5 * kRows) * 12, 175 * std::cos(angle)};
}

std::vector<ViewObservations> Observe(const Rig& rig, uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, kPixelSigma);
  std::vector<ViewObservations> views(rig.cameras.size());
  for (size_t c = 0; c < views.size(); ++c) {
    views[c].camera = static_cast<int>(c);
    for (int row = 0; row < kRows; ++row) {
      for (int col = 0; col < kCols; ++col) {
        const auto pixel = rig.cameras[c].Project(Place(row, col));
        if (!pixel || !rig.cameras[c].Contains(*pixel)) continue;
        const double x = pixel->x() + noise(random), y = pixel->y() + noise(random);
        views[c].observations.push_back(
            {x, y, {row, col, NodeKind::kCorner}, static_cast<float>(kPixelSigma), 0.99f});
      }
    }
  }
  return views;
}

// The weak cameras saw a board in every fifth frame only.
constexpr int kWeakCameras = 3;
CalibrationViews WithWeakCameras(CalibrationViews views) {
  std::erase_if(views.boards,
                [](const BoardView& view) { return view.camera < kWeakCameras && view.frame % 5 != 0; });
  return views;
}

struct CloudErrors {
  double chi_square = 0;  // e^T C^-1 e / 3, mean over the points
  double rms_mm = 0;
};

// After the world of the cloud is laid onto the true one.
CloudErrors ErrorsOf(const Cloud& cloud) {
  Eigen::Matrix3Xd is(3, cloud.points.size()), should = is;
  for (size_t i = 0; i < cloud.points.size(); ++i) {
    is.col(i) = cloud.points[i].position_mm;
    should.col(i) = Place(cloud.points[i].node.row, cloud.points[i].node.col);
  }
  const Eigen::Matrix4d motion = Eigen::umeyama(is, should, false);
  const Eigen::Matrix3d turn = motion.topLeftCorner<3, 3>();
  const double count = static_cast<double>(cloud.points.size());
  CloudErrors out;
  for (size_t i = 0; i < cloud.points.size(); ++i) {
    const Eigen::Vector3d error = turn * is.col(i) + motion.topRightCorner<3, 1>() - should.col(i);
    const Eigen::Matrix3d covariance = turn * cloud.points[i].covariance_mm2 * turn.transpose();
    out.chi_square += error.dot(covariance.ldlt().solve(error)) / 3 / count;
    out.rms_mm += error.squaredNorm() / 3 / count;
  }
  out.rms_mm = std::sqrt(out.rms_mm);
  return out;
}

TEST(CalibratedCloud, TrustsCamerasAsFarAsRigJsonSaysThatTheyAreKnown) {
  const std::string path = std::filesystem::path(::testing::TempDir()) / "calibrated_cloud_rig.json";
  CloudErrors with, without;
  constexpr int kRigs = 6;
  for (int seed = 1; seed <= kRigs; ++seed) {
    const SimulatedCalibration truth = Simulate(8, 40, 0.25, 2.5, {}, seed);
    const auto solved = SolveCalibration(truth.moved.target, WithWeakCameras(truth.views), std::nullopt, {});
    ASSERT_TRUE(solved.ok()) << solved.status();
    CalibrationRecord record;
    for (const CameraFit& fit : solved->cameras)
      record.cameras.push_back({.projection_sigma_px = fit.projection_sigma_px});
    const Rig rig{"calibrated", solved->bundle.cameras};
    ASSERT_TRUE(WriteRig(path, rig, "", &record).ok());
    const auto camera_sigma_px = ReadCameraSigmas(path);
    ASSERT_TRUE(camera_sigma_px.ok()) << camera_sigma_px.status();
    ASSERT_EQ(camera_sigma_px->size(), 8u);
    const std::vector<ViewObservations> views = Observe(truth.rig, seed);
    const auto knowing = TriangulateFrame(kNeverKept, rig, *camera_sigma_px, views, {});
    const auto unknowing = TriangulateFrame(kNeverKept, rig, {}, views, {});
    ASSERT_TRUE(knowing.ok() && unknowing.ok());
    EXPECT_GT(knowing->points.size(), 0.95 * kRows * kCols);
    const CloudErrors k = ErrorsOf(*knowing), u = ErrorsOf(*unknowing);
    with.chi_square += k.chi_square / kRigs;
    with.rms_mm += k.rms_mm / kRigs;
    without.rms_mm += u.rms_mm / kRigs;
  }
  EXPECT_NEAR(with.chi_square, 1, 0.25);
  EXPECT_LT(with.rms_mm, 0.9 * without.rms_mm);
}

TEST(CalibratedCloud, RigsThatKnowNoSigmasGiveNone) {
  const std::string path = std::filesystem::path(::testing::TempDir()) / "plain_rig.json";
  ASSERT_TRUE(WriteRig(path, MakeStudioRig("plain", {}).value()).ok());
  const auto sigmas = ReadCameraSigmas(path);
  ASSERT_TRUE(sigmas.ok()) << sigmas.status();
  EXPECT_TRUE(sigmas->empty());
}

}  // namespace
}  // namespace weft
