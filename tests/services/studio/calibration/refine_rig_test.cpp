// From stored observations to a corrected rig.json.
#include "services/studio/calibration/refine_rig.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <functional>
#include <numbers>
#include <random>
#include <sstream>

#include "services/formats/files/observations_file.h"
#include "simulation/studio_rig.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

// A result of two frames: a tube of cells that turns before sixteen cameras.
class RefineRigTest : public ::testing::Test {
 protected:
  void SetUp() override {
    StudioRigOptions options;
    options.cameras = 16;
    options.distance_mm = 2000;
    options.object_width_mm = 400;
    options.object_height_mm = 600;
    filmed_ = MakeStudioRig("studio", options).value();
    for (int frame = 0; frame < 2; ++frame) WriteFrame(frame);
    // Calibrated before camera c03 was knocked.
    before_ = filmed_;
    CameraModel& camera = before_.cameras[3];
    const Eigen::Vector3d center = camera.CenterWorld();
    camera.rotation =
        Eigen::AngleAxisd(0.05 * std::numbers::pi / 180, Eigen::Vector3d::UnitX()) * camera.rotation;
    camera.translation_mm = -camera.rotation * center;
    ASSERT_TRUE(WriteRig(folder_ / "rig.json", before_).ok());
    request_ = {.result = folder_ / "result", .rig = folder_ / "rig.json", .out = folder_ / "new.json"};
  }

  // Cameras with odd numbers measure with `odd_noise_px`; `tells`: whether the file has their sigmas.
  void WriteFrame(int frame, double odd_noise_px = 0.1, bool tells = true) {
    std::mt19937 random(frame);
    std::normal_distribution<double> noise(0, 1);
    std::vector<ImageObservations> images;
    for (const CameraModel& camera : filmed_.cameras) images.push_back({camera.id, {}});
    for (int row = 0; row < 60; ++row) {
      for (int col = 0; col < 100; ++col) {
        const double angle = 0.06 * col + 0.3 * frame;
        const Eigen::Vector3d normal(std::cos(angle), 0, std::sin(angle));
        const Eigen::Vector3d point = 150 * normal + Eigen::Vector3d(0, 8.0 * (row - 30), 0);
        for (size_t c = 0; c < images.size(); ++c) {
          const CameraModel& camera = filmed_.cameras[c];
          if (normal.dot((camera.CenterWorld() - point).normalized()) < 0.2) continue;
          const double later = static_cast<int>(c) == late_camera_ ? 1.5 * std::sin(0.4 * row) : 0;
          const auto pixel = camera.Project(point + Eigen::Vector3d(later, 0, later));
          if (!pixel || !camera.Contains(*pixel)) continue;
          const double sigma_px = c % 2 == 1 ? odd_noise_px : 0.1;
          const double x = sigma_px * noise(random), y = sigma_px * noise(random);
          images[c].observations.push_back({pixel->x() + x,
                                            pixel->y() + y,
                                            {row, col, NodeKind::kCenter},
                                            tells ? static_cast<float>(sigma_px) : 0.0f,
                                            1});
        }
      }
    }
    const std::string base = folder_ / ("result/000" + std::to_string(frame));
    std::filesystem::create_directories(base);
    ASSERT_TRUE(WriteObservations(base + "/observations.csv", images).ok());
  }

  // Root mean square of the cameras' errors of rotation after a refinement.
  double RotationErrorDeg() {
    const auto result = RefineRigFromResult(request_);
    EXPECT_TRUE(result.ok()) << result.status();
    if (!result.ok()) return 0;
    double sum = 0;
    for (size_t c = 0; c < 16; ++c) {
      const Eigen::AngleAxisd turn(result->rig.cameras[c].rotation * filmed_.cameras[c].rotation.transpose());
      sum += std::pow(turn.angle() * 180 / std::numbers::pi, 2);
    }
    return std::sqrt(sum / 16);
  }

  TempFolder folder_;
  int late_camera_ = -1;  // whose cloth has other folds
  Rig filmed_, before_;
  RefinementRequest request_;
};

TEST_F(RefineRigTest, TheKnockedCameraIsNamedAndSetRight) {
  const auto result = RefineRigFromResult(request_);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_THAT(result->frames, ElementsAre("0000", "0001"));
  const std::vector<std::string> text = RefinementText(*result);
  ASSERT_EQ(text.size(), 2u) << text[1];
  EXPECT_THAT(text[0], StartsWith("camera " + filmed_.cameras[3].id + " moved: turned by 0.0"));
  EXPECT_THAT(text[1], HasSubstr("points of 2 frames: reprojection error"));
  for (size_t c = 0; c < 16; ++c) {
    const Eigen::AngleAxisd turn(result->rig.cameras[c].rotation * filmed_.cameras[c].rotation.transpose());
    EXPECT_LT(turn.angle() * 180 / std::numbers::pi, 0.01) << c;
  }
  EXPECT_FALSE(result->record.has_value());
  EXPECT_THAT(result->provenance, HasSubstr("refined from the cloth in 2 frames of result"));
  const v1::RigRefinementReport report = RefinementReport(*result);
  EXPECT_TRUE(report.cameras(3).moved());
  EXPECT_NE(report.rig_hash(), report.rig_hash_before());
}

TEST_F(RefineRigTest, ExchangedCamerasAreNamedAndNothingElseMoves) {
  Rig exchanged = filmed_;
  std::swap(exchanged.cameras[3].id, exchanged.cameras[7].id);
  ASSERT_TRUE(WriteRig(folder_ / "rig.json", exchanged).ok());
  const auto result = RefineRigFromResult(request_);
  ASSERT_TRUE(result.ok()) << result.status();
  const v1::Verdict verdict = RefinementVerdict(*result);
  EXPECT_EQ(verdict.grade(), v1::GRADE_BAD);
  const std::string &a = filmed_.cameras[3].id, &b = filmed_.cameras[7].id;
  EXPECT_THAT(verdict.reason(), HasSubstr("cameras " + a + " and " + b + " are exchanged"));
  for (const CameraCorrection& correction : result->refined.corrections) EXPECT_FALSE(correction.moved);
  EXPECT_FALSE(RefinementReport(*result).written());
}

TEST_F(RefineRigTest, ACameraElsewhereStaysAndTheOthersAreRefined) {
  CameraModel& camera = before_.cameras[9];
  camera.rotation = Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitX()) * camera.rotation;
  ASSERT_TRUE(WriteRig(folder_ / "rig.json", before_).ok());
  const auto result = RefineRigFromResult(request_);
  ASSERT_TRUE(result.ok()) << result.status();
  const v1::Verdict verdict = RefinementVerdict(*result);
  EXPECT_EQ(verdict.grade(), v1::GRADE_USABLE);
  EXPECT_THAT(verdict.reason(), HasSubstr("camera " + camera.id + " agrees with no other"));
  EXPECT_TRUE(result->refined.corrections[9].held);
  EXPECT_TRUE(result->refined.corrections[3].moved);
  EXPECT_FALSE(result->refined.corrections[8].moved);
}

TEST_F(RefineRigTest, ALateCameraIsNamedAndStays) {
  late_camera_ = 9;
  for (int frame = 0; frame < 2; ++frame) WriteFrame(frame);
  const auto result = RefineRigFromResult(request_);
  ASSERT_TRUE(result.ok()) << result.status();
  const v1::Verdict verdict = RefinementVerdict(*result);
  EXPECT_EQ(verdict.grade(), v1::GRADE_USABLE);
  const std::string& id = filmed_.cameras[9].id;
  EXPECT_THAT(verdict.reason(), StartsWith("no pose of camera " + id + " explains its images: they stay "));
  EXPECT_THAT(verdict.remedy(), HasSubstr("late or repeated"));
  EXPECT_EQ(result->rig.cameras[9].rotation, result->before.cameras[9].rotation);
  const v1::RigRefinementReport report = RefinementReport(*result);
  EXPECT_TRUE(report.cameras(9).misfit());
  EXPECT_TRUE(report.cameras(3).moved());
  EXPECT_THAT(RefinementText(*result),
              testing::Contains("camera " + id + ": no pose puts it right, it stays as it was"));
}

TEST_F(RefineRigTest, PreciseObservationsCountMore) {
  for (int frame = 0; frame < 2; ++frame) WriteFrame(frame, 2.0);
  const double with_sigmas = RotationErrorDeg();
  const auto result = RefineRigFromResult(request_);
  ASSERT_TRUE(result.ok()) << result.status();
  for (int frame = 0; frame < 2; ++frame) WriteFrame(frame, 2.0, /*tells=*/false);
  const double without = RotationErrorDeg();
  EXPECT_LT(with_sigmas, 0.7 * without);
  const auto& corrections = result->refined.corrections;
  EXPECT_GT(corrections[5].rotation_sigma_deg, 2 * corrections[4].rotation_sigma_deg);
}

// As versions up to 0.1.2 wrote them.
TEST_F(RefineRigTest, FilesWithoutSigmasTakeTheOneOfTheRequest) {
  const double told = RotationErrorDeg();
  for (const char* frame : {"0000", "0001"}) {
    const std::string path = folder_ / ("result/" + std::string(frame) + "/observations.csv");
    std::istringstream lines(ReadBytes(path));
    std::string old;
    for (std::string line; std::getline(lines, line);) old += line.substr(0, line.rfind(',')) + "\n";
    WriteBytes(path, old);
  }
  request_.sigma_px = 0.1;  // what the noise is
  EXPECT_EQ(RotationErrorDeg(), told);
}

TEST_F(RefineRigTest, ErrorsSayWhatIsMissing) {
  request_.result = folder_ / "empty";
  std::filesystem::create_directories(request_.result);
  EXPECT_THAT(std::string(RefineRigFromResult(request_).status().message()),
              HasSubstr("register the take with --observations"));
  request_.result = folder_ / "result";
  before_.cameras[2].id = "other";
  ASSERT_TRUE(WriteRig(folder_ / "rig.json", before_).ok());
  EXPECT_THAT(std::string(RefineRigFromResult(request_).status().message()), HasSubstr("is not in the rig"));
}

// What the file says of the calibration is kept, but for the poses that were refined.
TEST_F(RefineRigTest, ACalibrationCountsOnAndKeepsItsLenses) {
  CalibrationRecord record;
  record.version = 4;
  record.calibrated_utc = "2020-01-31T10:45:00Z";
  record.cameras.resize(16);
  for (CalibratedCamera& camera : record.cameras) camera.sigmas.fill(0.25);
  ASSERT_TRUE(WriteRig(folder_ / "rig.json", before_, "", &record).ok());
  std::vector<double> shares;
  const auto result = RefineRigFromResult(request_, [&](double share) { shares.push_back(share); });
  ASSERT_TRUE(result.ok()) << result.status();
  ASSERT_TRUE(result->record.has_value());
  EXPECT_EQ(result->record->version, 5);
  EXPECT_EQ(result->record->replaces, before_.ContentHash());
  EXPECT_GT(result->record->calibrated_utc, record.calibrated_utc);
  for (size_t c = 0; c < 16; ++c) {
    const CameraCorrection& correction = result->refined.corrections[c];
    for (size_t i = 0; i < 9; ++i) EXPECT_EQ(result->record->cameras[c].sigmas[i], 0.25) << c << " " << i;
    if (correction.held) continue;
    for (int i = 0; i < 6; ++i) {
      const double sigma = result->record->cameras[c].sigmas[static_cast<size_t>(9 + i)];
      EXPECT_NEAR(sigma * sigma, correction.covariance(i, i), 1e-9 * correction.covariance(i, i)) << c;
    }
  }
  EXPECT_THAT(shares, ElementsAre(0.35, 0.7, 1));
}

TEST(RefinementRequest, NeedsFramesPointsAndSizes) {
  const auto why = [](const std::function<void(RefinementRequest&)>& change) {
    RefinementRequest request;
    change(request);
    return std::string(request.Validate().message());
  };
  EXPECT_EQ(why([](RefinementRequest&) {}), "");
  EXPECT_EQ(why([](RefinementRequest& r) { r.frames = 1, r.points = 100; }), "");
  EXPECT_EQ(why([](RefinementRequest& r) { r.frames = 0; }), "frames must be at least 1");
  EXPECT_EQ(why([](RefinementRequest& r) { r.points = 99; }), "points must be at least 100");
  EXPECT_EQ(why([](RefinementRequest& r) { r.sigma_px = 0; }), "sigma_px must be positive");
  EXPECT_EQ(why([](RefinementRequest& r) { r.radius_mm = 0; }), "radius_mm must be positive");
  EXPECT_EQ(RefinementRequest().frames, 20);
  EXPECT_EQ(RefinementRequest().points, 2000);
}

}  // namespace
}  // namespace weft
