#include "animation/sparse_view/sparse_view_driver.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "animation/sparse_view/sparse_view_training.h"
#include "tests/animation/recorded.h"
#include "tests/animation/waving_tube.h"

namespace weft {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr int kSeed = 17;  // of motions that no avatar has learnt
constexpr int64_t kFrameNs = 33'333'333;

const SparseViewAvatar& LearntAvatar() {
  static const SparseViewAvatar avatar = *TrainSparseView(WavingTube::Garment(), WavingTube::Frames(),
                                                          {.components = 12, .calibration_frames = 16});
  return avatar;
}

SparseViewDriver NewDriver() { return *SparseViewDriver::Create(WavingTube::Garment(), LearntAvatar()); }

// A rig whose cameras can be dark, lie, and stand elsewhere.
class Studio {
 public:
  explicit Studio(int cameras)
      : cameras_(CamerasAround(cameras)), told_(cameras_), shown_(cameras_.size(), 1) {}
  void Move(const Eigen::Isometry3d& motion) {
    for (CameraModel& camera : cameras_) camera = Moved(camera, motion);
    told_ = cameras_;
    motion_ = motion * motion_;
  }
  std::vector<Eigen::Vector3d> Truth(int frame) const {
    std::vector<Eigen::Vector3d> out = WavingTube::At(frame, kSeed);
    for (Eigen::Vector3d& p : out) p = motion_ * p;
    return out;
  }
  // From now on a camera is told to look elsewhere than it does.
  void Knock(int camera, double turn_deg) {
    told_[camera] = cameras_[camera];
    const Eigen::Matrix3d by =
        Eigen::AngleAxisd(turn_deg * std::numbers::pi / 180, Eigen::Vector3d::UnitY()).toRotationMatrix();
    told_[camera].rotation = by * told_[camera].rotation;
    told_[camera].translation_mm = by * told_[camera].translation_mm;
  }
  // From now on the picture of a camera shows this share of what it sees of the garment.
  void Hide(int camera, double shown) { shown_[camera] = shown; }
  DrivenFrame Drive(SparseViewDriver& driver, int frame, const std::vector<int>& order,
                    double wrong_share = 0) const {
    std::vector<std::vector<Observation>> seen(cameras_.size());
    std::vector<DrivingView> views;
    for (const int c : order) {
      seen[c] = WavingTube::Seen(cameras_[c], Truth(frame), frame, wrong_share);
      if (shown_[c] < 1) {
        std::sort(seen[c].begin(), seen[c].end(),
                  [](const Observation& a, const Observation& b) { return a.y_px < b.y_px; });
        seen[c].resize(static_cast<size_t>(shown_[c] * static_cast<double>(seen[c].size())));
      }
      views.push_back({&told_[c], seen[c]});
    }
    auto driven = driver.Drive(frame * kFrameNs, views);
    EXPECT_TRUE(driven.ok()) << driven.status();
    return *std::move(driven);
  }

 private:
  std::vector<CameraModel> cameras_, told_;
  std::vector<double> shown_;
  Eigen::Isometry3d motion_ = Eigen::Isometry3d::Identity();
};

TEST(SparseViewDriver, FollowsAGarmentBeforeTwoCamerasAndBetterBeforeThree) {
  double error[2] = {0, 0};
  for (const int cameras : {2, 3}) {
    const Studio studio(cameras);
    SparseViewDriver driver = NewDriver();
    const std::vector<int> all = cameras == 2 ? std::vector<int>{0, 1} : std::vector<int>{0, 1, 2};
    for (int frame = 0; frame < 12; ++frame) {
      const DrivenFrame driven = studio.Drive(driver, frame, all);
      EXPECT_FALSE(driven.lost) << driven.reason;
      EXPECT_EQ(driven.started_anew, frame == 0);
      EXPECT_LT(driven.residual_px, 0.5);
      EXPECT_EQ(driven.rays_of_view.size(), all.size());
      error[cameras - 2] += MeanDistance(driven.mesh.vertices_mm, studio.Truth(frame)) / 12;
    }
  }
  EXPECT_LT(error[0], 4);
  EXPECT_LT(error[1], error[0]);
}

TEST(SparseViewDriver, StatesFollowTheNumberOfRays) {
  const Studio studio(4);
  SparseViewDriver driver = NewDriver();
  const DrivenFrame driven = studio.Drive(driver, 0, {0, 1, 2, 3});
  bool has_two = false;
  for (size_t v = 0; v < driven.mesh.state.size(); ++v) {
    const int views = driven.mesh.views[v];
    has_two = has_two || views == 2;
    const VertexState expected = views < 2    ? VertexState::kDriven
                                 : views == 2 ? VertexState::kTwoView
                                              : VertexState::kObserved;
    EXPECT_EQ(driven.mesh.state[v], expected);
  }
  EXPECT_TRUE(has_two);
}

TEST(SparseViewDriver, SigmaIsAsLargeAsTheErrors) {
  for (const int cameras : {2, 3}) {
    const Studio studio(cameras);
    SparseViewDriver driver = NewDriver();
    int within = 0, within_two = 0, all = 0;
    for (int frame = 0; frame < 20; ++frame) {
      std::vector<int> order = {0, 1, 2};
      order.resize(static_cast<size_t>(cameras));
      const DrivenFrame driven = studio.Drive(driver, frame, order);
      const auto truth = studio.Truth(frame);
      for (size_t v = 0; v < truth.size(); ++v) {
        const double off = (driven.mesh.vertices_mm[v] - truth[v]).norm();
        within += off < driven.mesh.sigma_mm[v] ? 1 : 0;
        within_two += off < 2 * driven.mesh.sigma_mm[v] ? 1 : 0;
        ++all;
      }
    }
    // Three takes of one motion each teach little about the depth of a fourth.
    EXPECT_GT(within, (cameras == 2 ? 0.25 : 0.5) * all) << cameras;
    EXPECT_LT(within, 0.9 * all) << cameras;
    EXPECT_GT(within_two, (cameras == 2 ? 0.45 : 0.85) * all) << cameras;
  }
}

// A camera that shows a few cells of it knows little more than none.
TEST(SparseViewDriver, SigmaGrowsAsTheGarmentLeavesAPicture) {
  std::vector<double> sigma_mm;
  for (const double shown : {1.0, 0.5, 0.25, 0.02, 0.0}) {
    Studio studio(2);
    SparseViewDriver driver = NewDriver();
    double sum = 0;
    for (int frame = 0; frame < 12; ++frame) {
      if (frame == 4) studio.Hide(1, shown);
      const DrivenFrame driven = studio.Drive(
          driver, frame, frame >= 4 && shown == 0 ? std::vector<int>{0} : std::vector<int>{0, 1});
      ASSERT_FALSE(driven.lost) << driven.reason;
      if (frame < 4) continue;
      for (const float sigma : driven.mesh.sigma_mm) sum += sigma;
    }
    sigma_mm.push_back(sum);
  }
  for (size_t k = 0; k + 2 < sigma_mm.size(); ++k) EXPECT_GT(sigma_mm[k + 1], sigma_mm[k]);
  EXPECT_GT(sigma_mm[3], 0.8 * sigma_mm[4]);
}

TEST(SparseViewDriver, SigmaGrowsWithTheWayAlongTheClothThatNoCameraSees) {
  Studio studio(3);
  for (int camera = 0; camera < 3; ++camera) studio.Hide(camera, 0.4);
  SparseViewDriver driver = NewDriver();
  for (int frame = 0; frame < 4; ++frame) {
    const DrivenFrame driven = studio.Drive(driver, frame, {0, 1, 2});
    ASSERT_FALSE(driven.lost) << driven.reason;
    std::vector<double> of_row;
    for (int row = 0; row < WavingTube::kRows; ++row) {
      const int first = row * WavingTube::kColumns, last = first + WavingTube::kColumns;
      if (std::any_of(driven.mesh.views.begin() + first, driven.mesh.views.begin() + last,
                      [](int rays) { return rays > 0; }))
        continue;
      of_row.push_back(0);
      for (int v = first; v < last; ++v) of_row.back() += driven.mesh.sigma_mm[v] / WavingTube::kColumns;
    }
    ASSERT_GE(of_row.size(), 5u);
    if (of_row.front() > of_row.back()) std::reverse(of_row.begin(), of_row.end());
    for (size_t k = 0; k + 1 < of_row.size(); ++k) EXPECT_GT(of_row[k + 1], 1.05 * of_row[k]);
    EXPECT_GT(of_row.back(), 1.5 * of_row.front());
  }
}

TEST(SparseViewDriver, MovesWithItsCameras) {
  Studio here(2), there(2);
  const Eigen::Isometry3d motion = Eigen::Translation3d(4000, -300, 900) *
                                   Eigen::AngleAxisd(1.9, Eigen::Vector3d(1, -2, 0.5).normalized());
  there.Move(motion);
  SparseViewDriver one = NewDriver(), other = NewDriver();
  for (int frame = 0; frame < 4; ++frame) {
    const DrivenFrame a = here.Drive(one, frame, {0, 1}), b = there.Drive(other, frame, {0, 1});
    std::vector<Eigen::Vector3d> moved;
    for (const Eigen::Vector3d& p : a.mesh.vertices_mm) moved.push_back(motion * p);
    EXPECT_LT(MeanDistance(moved, b.mesh.vertices_mm), 0.1) << frame;
  }
}

TEST(SparseViewDriver, OrderOfCamerasAndNumberOfThreadsDoNotMatter) {
  const Studio studio(3);
  SparseViewDriver one = NewDriver(), other = NewDriver();
  for (int frame = 0; frame < 3; ++frame) {
    const DrivenFrame a = studio.Drive(one, frame, {0, 1, 2});
    const tbb::global_control single(tbb::global_control::max_allowed_parallelism, 1);
    const DrivenFrame b = studio.Drive(other, frame, {2, 0, 1});
    EXPECT_EQ(a.mesh.vertices_mm, b.mesh.vertices_mm);
    EXPECT_EQ(a.mesh.sigma_mm, b.mesh.sigma_mm);
    EXPECT_EQ(a.rays_of_view[0], b.rays_of_view[1]);
  }
}

TEST(SparseViewDriver, GoesOnFromAMemoryToTheSameBytes) {
  const Studio studio(3);
  SparseViewDriver whole = NewDriver();
  for (int frame = 0; frame < 5; ++frame) studio.Drive(whole, frame, {0, 1, 2});
  const DriverMemory memory = whole.Memory();
  SparseViewDriver later = NewDriver();
  ASSERT_TRUE(later.Restore(memory).ok());
  for (int frame = 5; frame < 8; ++frame) {
    const DrivenFrame a = studio.Drive(whole, frame, {0, 1, 2}), b = studio.Drive(later, frame, {0, 1, 2});
    EXPECT_FALSE(b.started_anew);
    EXPECT_EQ(a.mesh.vertices_mm, b.mesh.vertices_mm);
    EXPECT_EQ(a.mesh.sigma_mm, b.mesh.sigma_mm);
  }
  // A driver without it finds the garment anew.
  SparseViewDriver forgetful = NewDriver();
  EXPECT_TRUE(studio.Drive(forgetful, 5, {0, 1, 2}).started_anew);
  DriverMemory other = memory;
  other.drive.track.state.z.conservativeResize(5);
  EXPECT_THAT(later.Restore(other).message(), HasSubstr("of another avatar"));
  other = memory;
  other.drive.track.state.z[2] = std::nan("");
  EXPECT_THAT(later.Restore(other).message(), HasSubstr("not finite"));
  other = memory;
  other.drive.track.state.local = Eigen::MatrixXd::Zero(3, 2);
  EXPECT_THAT(later.Restore(other).message(), HasSubstr("other regions"));
  other = memory;
  other.drive.mesh_mm.resize(7);
  EXPECT_THAT(later.Restore(other).message(), HasSubstr("has 7 vertices"));
}

TEST(SparseViewDriver, CamerasAreOffTheCarrierWhereOneMoved) {
  for (const int cameras : {2, 3}) {
    const std::vector<int> all = cameras == 2 ? std::vector<int>{0, 1} : std::vector<int>{0, 1, 2};
    double longest_px[2] = {0, 0}, significance[2] = {0, 0};
    for (const bool is_knocked : {false, true}) {
      Studio studio(cameras);
      if (is_knocked) studio.Knock(0, 1);
      SparseViewDriver driver = NewDriver();
      std::vector<Eigen::Vector2d> mean_px(all.size(), Eigen::Vector2d::Zero());
      for (int frame = 0; frame < 12; ++frame) {
        const DrivenFrame driven = studio.Drive(driver, frame, all);
        ASSERT_EQ(driven.bias_of_view.size(), all.size());
        for (size_t c = 0; c < all.size(); ++c) {
          mean_px[c] += driven.bias_of_view[c].mean_px / 12;
          significance[is_knocked] = std::max(significance[is_knocked], driven.bias_of_view[c].significance);
        }
      }
      for (const Eigen::Vector2d& mean : mean_px)
        longest_px[is_knocked] = std::max(longest_px[is_knocked], mean.norm());
    }
    // The limits of the alarm in a job's report.
    EXPECT_LT(longest_px[0], 0.1) << cameras;
    EXPECT_GT(longest_px[1], 0.2) << cameras;
    EXPECT_GT(significance[1], 4) << cameras;
  }
}

TEST(SparseViewDriver, WrongIdentitiesAreSetAside) {
  const Studio studio(3);
  SparseViewDriver driver = NewDriver();
  double error = 0;
  for (int frame = 0; frame < 5; ++frame) {
    const DrivenFrame driven = studio.Drive(driver, frame, {0, 1, 2}, 0.08);
    EXPECT_GT(driven.rejected_rays, driven.rays / 25);
    error = MeanDistance(driven.mesh.vertices_mm, studio.Truth(frame));
  }
  EXPECT_LT(error, 2);
}

TEST(SparseViewDriver, OneDarkCameraIsSurvivedAndDarknessIsSaid) {
  const Studio studio(2);
  SparseViewDriver driver = NewDriver();
  double before = 0, after = 0;
  for (int frame = 0; frame < 40; ++frame) {
    const bool one_is_dark = frame >= 10 && frame < 25;
    const DrivenFrame driven =
        studio.Drive(driver, frame, one_is_dark ? std::vector<int>{1} : std::vector<int>{0, 1});
    ASSERT_FALSE(driven.lost) << frame << ": " << driven.reason;
    double worst = 0;
    const auto truth = studio.Truth(frame);
    for (size_t v = 0; v < truth.size(); ++v)
      worst = std::max(worst, (driven.mesh.vertices_mm[v] - truth[v]).norm());
    EXPECT_LT(worst, 80) << frame;
    if (frame == 9) before = MeanDistance(driven.mesh.vertices_mm, truth);
    if (frame == 34) after = MeanDistance(driven.mesh.vertices_mm, truth);
  }
  EXPECT_LT(after, before + 1);
  const CameraModel camera = CamerasAround(2)[0];
  const std::vector<DrivingView> dark = {{&camera, {}}};
  const auto lost = driver.Drive(41 * kFrameNs, dark);
  ASSERT_TRUE(lost.ok()) << lost.status();
  EXPECT_TRUE(lost->lost);
  EXPECT_THAT(lost->reason, HasSubstr("0 cells of the garment were seen"));
  EXPECT_GT(lost->mesh.sigma_mm[0], 500);
  const DrivenFrame found = studio.Drive(driver, 60, {0, 1});
  EXPECT_FALSE(found.lost);
  EXPECT_TRUE(found.started_anew);
  EXPECT_LT(MeanDistance(found.mesh.vertices_mm, studio.Truth(60)), 3);
}

TEST(SparseViewDriver, CellsOfNoShapeAreLost) {
  const CameraModel camera = CamerasAround(2)[0];
  std::vector<Observation> seen;
  for (int k = 0; k < 200; ++k)
    seen.push_back({960 * UniformOf(3, static_cast<uint64_t>(2 * k)),
                    1280 * UniformOf(3, static_cast<uint64_t>(2 * k + 1)),
                    {k / 20, k % 20, NodeKind::kCenter},
                    0.1f,
                    1});
  SparseViewDriver driver = NewDriver();
  const std::vector<DrivingView> views = {{&camera, seen}};
  const auto driven = driver.Drive(0, views);
  ASSERT_TRUE(driven.ok()) << driven.status();
  EXPECT_TRUE(driven->lost);
  EXPECT_THAT(driven->reason, HasSubstr("agree with a shape of the garment"));
}

TEST(SparseViewDriver, RefusesWhatDoesNotBelongTogether) {
  Template other = WavingTube::Garment();
  other.rest.vertices_mm[5].x() += 1;
  const std::string hash = WavingTube::Garment().ContentHash(), other_hash = other.ContentHash();
  const absl::Status wrong = SparseViewDriver::Create(other, LearntAvatar()).status();
  EXPECT_TRUE(absl::IsFailedPrecondition(wrong));
  EXPECT_THAT(wrong.message(), AllOf(HasSubstr(hash), HasSubstr(other_hash)));
  other = WavingTube::Garment();
  other.board_hash = "fedcba9876543210";
  EXPECT_THAT(SparseViewDriver::Create(other, LearntAvatar()).status().message(),
              AllOf(HasSubstr("0123456789abcdef"), HasSubstr("fedcba9876543210")));
  SparseViewAvatar broken = LearntAvatar();
  broken.edge_mm.pop_back();
  EXPECT_TRUE(absl::IsInvalidArgument(SparseViewDriver::Create(WavingTube::Garment(), broken).status()));
  SparseViewDriver driver = NewDriver();
  EXPECT_THAT(driver.Drive(0, {}).status().message(), HasSubstr("without views"));
  const Studio studio(2);
  studio.Drive(driver, 3, {0, 1});
  const CameraModel camera = CamerasAround(2)[0];
  const std::vector<DrivingView> views = {{&camera, {}}};
  EXPECT_THAT(driver.Drive(kFrameNs, views).status().message(), HasSubstr("comes after one at"));
}

// All that a frame tells, of a garment that is followed, lies, is lost, and is found again.
TEST(SparseViewDriver, FramesStayAsTheyAre) {
  Recorded recorded;
  const auto record = [&](const DrivenFrame& driven) {
    std::vector<Eigen::Vector2d> mean_px;
    std::vector<double> significance, rms_px;
    std::vector<int> states;
    for (const CameraBias& bias : driven.bias_of_view)
      mean_px.push_back(bias.mean_px), significance.push_back(bias.significance),
          rms_px.push_back(bias.rms_px);
    for (const VertexState state : driven.mesh.state) states.push_back(static_cast<int>(state));
    recorded.Add("lost", driven.lost);
    recorded.Add("anew", driven.started_anew);
    recorded.Add("vertices", driven.mesh.vertices_mm);
    recorded.Add("sigma", driven.mesh.sigma_mm);
    recorded.Add("states", states);
    recorded.Add("carrier", driven.carrier_mm);
    recorded.Add("rejected", driven.rejected_rays);
    recorded.Add("rays", driven.rays_of_view);
    recorded.Add("bias", mean_px);
    recorded.Add("rms", rms_px);
    recorded.Add("significance", significance);
    recorded.Add("residual", driven.residual_px);
  };
  Studio studio(3);
  SparseViewDriver driver = NewDriver();
  record(studio.Drive(driver, 0, {2, 0}, 0.06));
  record(studio.Drive(driver, 1, {2, 0}));
  record(studio.Drive(driver, 4, {0, 1, 2}, 0.06));
  studio.Hide(1, 0.3);
  record(studio.Drive(driver, 5, {0, 1}));
  studio.Hide(0, 0.1), studio.Hide(1, 0.05);
  record(studio.Drive(driver, 6, {0, 1}));
  record(studio.Drive(driver, 7, {2}));
  record(studio.Drive(driver, 60, {2, 1}));
  const DriverMemory memory = driver.Memory();
  recorded.Add("z", memory.drive.track.state.z);
  recorded.Add("z before", memory.drive.track.z_before);
  recorded.Add("local", memory.drive.track.state.local);
  recorded.Add("known", memory.drive.track.known);
  recorded.Expect();
}

}  // namespace
}  // namespace weft
