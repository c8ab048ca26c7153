#include "animation/sparse_view/net_correction.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "animation/sparse_view/sparse_view_driver.h"
#include "animation/sparse_view/sparse_view_training.h"
#include "tests/animation/recorded.h"
#include "tests/animation/shift_net.h"
#include "tests/animation/waving_tube.h"

namespace weft {
namespace {

using testing::HasSubstr;

const Eigen::Vector3f kShiftMm(3, 0, -1);

const SparseViewAvatar& TubeAvatar() {
  static const SparseViewAvatar avatar = [] {
    SparseViewTraining training;
    training.components = 12;
    training.calibration_frames = 1;
    SparseViewAvatar out = *TrainSparseView(WavingTube::Garment(), WavingTube::Frames(), training);
    out.net = ShiftNet();
    return out;
  }();
  return avatar;
}

// The tube at a moment, driven without an error.
struct DrivenTube {
  AlignmentModel model{WavingTube::Garment()};
  RayDrivenFrame frame;
  std::vector<VertexRay> rays;

  DrivenTube() {
    frame.position_mm = frame.carrier_mm = WavingTube::At(20, 2);
    frame.misfit.assign(frame.position_mm.size(), 1);
    for (int v = 0; v < 40; ++v)
      rays.push_back(
          {v, 0, {0, 0, -2000}, (frame.position_mm[v] - Eigen::Vector3d(0, 0, -2000)).normalized(), 1e-4});
    frame.rejected.assign(rays.size(), false);
  }
};

TEST(NetCorrection, MovesTheClothInItsOwnAxes) {
  const DrivenTube tube;
  auto net = NetCorrection::Create(WavingTube::Garment(), tube.model, TubeAvatar());
  ASSERT_TRUE(net.ok()) << net.status();
  const auto corrected = net->Correct(tube.frame, tube.rays);
  ASSERT_TRUE(corrected.ok()) << corrected.status();
  const auto axes = CanonicalAxes(tube.model.rest(), tube.model.graph()).RotationsOf(tube.frame.position_mm);
  for (size_t v = 0; v < axes.size(); ++v) {
    const Eigen::Vector3d moved = corrected->position_mm[v] - tube.frame.position_mm[v];
    EXPECT_LT((moved.cast<float>() - axes[v] * kShiftMm).norm(), 1e-3f);
    EXPECT_NEAR(corrected->deviation_mm[v], 2 * std::exp(3 * std::tanh(-1.0 / 3)), 1e-4);
  }
}

TEST(NetCorrection, RefusesANetThatAnswersOtherwise) {
  const DrivenTube tube;
  const auto refusal = [&](const SparseViewAvatar& avatar) {
    return std::string(NetCorrection::Create(WavingTube::Garment(), tube.model, avatar).status().message());
  };
  SparseViewAvatar avatar = TubeAvatar();
  avatar.net.sample_answer.values[3] += 0.1f;
  EXPECT_THAT(refusal(avatar), HasSubstr("does not answer as it did"));
  avatar = TubeAvatar();
  avatar.net.onnx.resize(avatar.net.onnx.size() / 2);
  EXPECT_THAT(refusal(avatar), HasSubstr("is no net"));
  avatar = TubeAvatar();
  avatar.net.sample.channels = 5;
  avatar.net.sample.values.resize(5 * 64);
  EXPECT_THAT(refusal(avatar), HasSubstr("takes \"image\" of 27 x any x any, and this one is of 5 x 8 x 8"));
}

TEST(NetCorrection, RefusesANetWithOtherNamesOrChannels) {
  EXPECT_TRUE(CheckNet(ShiftNet()).ok());
  EXPECT_THAT(std::string(CheckNet(ShiftNet(), {27, 3}).message()),
              HasSubstr("makes \"answer\" of 4 x any x any of \"image\" of 27 x any x any, expected "
                        "\"answer\" of 3 x any x any"));
  EXPECT_FALSE(CheckNet(ShiftNet(), {26, 4}).ok());
  AvatarNet other = ShiftNet();
  for (size_t at = 0; (at = other.onnx.find("answer", at)) != std::string::npos;)
    other.onnx.replace(at, 6, "offset");
  EXPECT_THAT(std::string(CheckNet(other).message()), HasSubstr("makes \"offset\""));
}

TEST(NetCorrection, IsToldWhatFeaturesPromise) {
  const DrivenTube tube;
  const DrivingFeatures features(tube.model, TubeAvatar());
  const auto axes = features.axes().RotationsOf(tube.frame.position_mm);
  const std::vector<float> of = features.Of(tube.frame, tube.rays, axes);
  ASSERT_EQ(of.size(), axes.size() * kDrivingFeatures);
  for (size_t v = 0; v < axes.size(); ++v) {
    const float* f = &of[v * kDrivingFeatures];
    EXPECT_EQ(f[0], 1);
    EXPECT_EQ(Eigen::Vector3f(f[1], f[2], f[3]).norm(), 0);  // driven as its carrier
    const bool is_seen = v < 40;
    EXPECT_NEAR(f[10], is_seen ? 1.0 / 3 : 0, 1e-6);
    // The trace of I - d d^T is 2.
    EXPECT_NEAR(f[4] + f[5] + f[6], is_seen ? 2 : 0, 1e-4);
    const Eigen::Vector3f direction(f[11], f[12], f[13]);
    EXPECT_NEAR(direction.norm(), is_seen ? 1 : 0, 1e-4);
    if (is_seen) {
      EXPECT_LT((axes[v] * direction - tube.rays[v].direction.cast<float>()).norm(), 1e-4f);
    }
    EXPECT_NEAR(Eigen::Vector3f(f[14], f[15], f[16]).norm(), 1, 1e-4);
  }
}

// It never learnt what one camera leaves open.
TEST(NetCorrection, IsNotAskedAboutOneCamera) {
  auto driver = SparseViewDriver::Create(WavingTube::Garment(), TubeAvatar());
  ASSERT_TRUE(driver.ok()) << driver.status();
  const CameraModel front = CameraAt("front", 0, {0, 0, 0});
  const auto seen = WavingTube::Seen(front, WavingTube::At(20, 7), 1);
  const std::vector<DrivingView> views = {{&front, seen}};
  const auto driven = driver->Drive(1, views);
  ASSERT_TRUE(driven.ok()) << driven.status();
  EXPECT_TRUE(driven->uncorrected_mm.empty());
}

// Rays are kept whatever the net says: it moves what no ray holds.
TEST(NetCorrection, DoesNotMoveWhatIsSeen) {
  const Template garment = WavingTube::Garment();
  SparseViewAvatar without = TubeAvatar();
  without.net = {};
  auto plain = SparseViewDriver::Create(garment, without),
       driver = SparseViewDriver::Create(garment, TubeAvatar());
  ASSERT_TRUE(driver.ok()) << driver.status();
  const CameraModel front = CameraAt("front", 0, {0, 0, 0}), back = CameraAt("back", 180, {0, 0, 0});
  const std::vector<Eigen::Vector3d> truth = WavingTube::At(20, 7);
  const auto in_front = WavingTube::Seen(front, truth, 1), behind = WavingTube::Seen(back, truth, 2);
  const std::vector<DrivingView> views = {{&front, in_front}, {&back, behind}};
  const auto a = plain->Drive(1, views), b = driver->Drive(1, views);
  ASSERT_TRUE(a.ok() && b.ok());
  ASSERT_FALSE(b->lost);
  EXPECT_TRUE(a->uncorrected_mm.empty());
  double unseen = 0;
  for (size_t v = 0; v < truth.size(); ++v) {
    EXPECT_EQ((b->uncorrected_mm[v] - a->mesh.vertices_mm[v]).norm(), 0);
    if (b->mesh.views[v] == 0)
      unseen = std::max(unseen, (b->mesh.vertices_mm[v] - b->uncorrected_mm[v]).norm());
  }
  EXPECT_GT(unseen, 0.3);
  EXPECT_LT(b->residual_px, a->residual_px + 0.1);
}

TEST(NetCorrection, FramesStayAsTheyAre) {
  auto driver = SparseViewDriver::Create(WavingTube::Garment(), TubeAvatar());
  ASSERT_TRUE(driver.ok()) << driver.status();
  const CameraModel front = CameraAt("front", 0, {0, 0, 0}), back = CameraAt("back", 150, {0, 0, 0});
  Recorded recorded;
  for (const int frame : {20, 21}) {
    const std::vector<Eigen::Vector3d> truth = WavingTube::At(frame, 7);
    const auto in_front = WavingTube::Seen(front, truth, 1, 0.03), behind = WavingTube::Seen(back, truth, 2);
    const std::vector<DrivingView> views = {{&front, in_front}, {&back, behind}};
    const auto driven = driver->Drive(frame * int64_t{33'333'333}, views);
    ASSERT_TRUE(driven.ok()) << driven.status();
    recorded.Add("vertices", driven->mesh.vertices_mm);
    recorded.Add("uncorrected", driven->uncorrected_mm);
    recorded.Add("sigma", driven->mesh.sigma_mm);
    recorded.Add("rejected", driven->rejected_rays);
    std::vector<std::string> times;
    for (const StageTime& time : driven->times) times.push_back(time.name);
    EXPECT_EQ(times, (std::vector<std::string>{"rays", "track", "polish", "net", "second polish", "sigma"}));
  }
  recorded.Expect();
}

// A net whose answers help held-out frames stays, with what it gains; its frames are driven by it.
TEST(NetCorrection, ItsGainIsMeasuredOnFramesThatAreHeldOut) {
  const Template garment = WavingTube::Garment();
  const TrainingFrames frames = WavingTube::Frames(2, 24);
  SparseViewAvatar avatar = *LearnSparseView(garment, frames, {.components = 3, .calibration_frames = 2});
  avatar.net = ShiftNet();
  std::vector<double> shares;
  ASSERT_TRUE(CalibrateSparseView(
                  garment, frames,
                  [&](std::string_view stage, double share) {
                    EXPECT_EQ(stage, "sigma");
                    shares.push_back(share);
                  },
                  {}, &avatar)
                  .ok());
  EXPECT_EQ(shares, std::vector<double>{1}) << "one motion cannot be left out";
  EXPECT_EQ(avatar.net.empty(), !avatar.net.IsOfUse());
  EXPECT_EQ(avatar.net.gain[0].frames, 0) << "it is not asked about one camera";
  Recorded recorded;
  for (size_t k = 1; k < 4; ++k) {
    EXPECT_EQ(avatar.net.gain[k].frames, 4);
    recorded.Add("before", avatar.net.gain[k].before_mm);
    recorded.Add("after", avatar.net.gain[k].after_mm);
  }
  recorded.Expect();
}

}  // namespace
}  // namespace weft
