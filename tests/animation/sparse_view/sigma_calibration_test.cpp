#include "animation/sparse_view/sigma_calibration.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include "animation/sparse_view/sparse_view_driver.h"
#include "animation/sparse_view/sparse_view_training.h"
#include "tests/animation/recorded.h"
#include "tests/animation/waving_tube.h"

namespace weft {
namespace {

constexpr SparseViewTraining kFewFrames{.components = 8, .calibration_frames = 16};

SparseViewAvatar Learn(const TrainingFrames& frames) {
  absl::StatusOr<SparseViewAvatar> avatar = TrainSparseView(WavingTube::Garment(), frames, kFewFrames);
  EXPECT_TRUE(avatar.ok()) << avatar.status();
  return avatar.ok() ? *std::move(avatar) : SparseViewAvatar();
}

// Shares of vertices within one and two sigma before three cameras; the tube bends `more` than in training.
struct Shares {
  double one = 0, two = 0, sigma_mm = 0;
};
Shares SharesOf(const SparseViewAvatar& avatar, double more) {
  SparseViewDriver driver = *SparseViewDriver::Create(WavingTube::Garment(), avatar);
  const std::vector<CameraModel> cameras = CamerasAround(3);
  Shares out;
  double all = 0;
  for (int frame = 0; frame < 30; ++frame) {
    const auto truth =
        WavingTube::Shape(more * 0.12 * std::sin(0.11 * frame), 0.3 * std::sin(0.07 * frame), 0);
    std::vector<std::vector<Observation>> seen;
    for (const CameraModel& camera : cameras)
      seen.push_back(WavingTube::Seen(camera, truth, static_cast<uint64_t>(frame)));
    std::vector<DrivingView> views;
    for (size_t c = 0; c < cameras.size(); ++c) views.push_back({&cameras[c], seen[c]});
    const auto driven = driver.Drive(1 + frame * int64_t{33'333'333}, views);
    EXPECT_TRUE(driven.ok() && !driven->lost);
    if (frame < 5 || !driven.ok()) continue;
    for (size_t v = 0; v < truth.size(); ++v) {
      const double error = (driven->mesh.vertices_mm[v] - truth[v]).norm(), sigma = driven->mesh.sigma_mm[v];
      out.one += error < sigma ? 1 : 0, out.two += error < 2 * sigma ? 1 : 0, out.sigma_mm += sigma;
      ++all;
    }
  }
  out.one /= all, out.two /= all, out.sigma_mm /= all;
  return out;
}

TEST(SigmaCalibration, IsTriedOnHeldOutFramesAndOnMotionsLeftOutInTurn) {
  const SparseViewAvatar avatar = Learn(WavingTube::Frames(4, 40));
  EXPECT_EQ(avatar.held_out_check.frames, 16);
  EXPECT_GE(avatar.left_out_check.frames, 16);
  for (const SigmaCheck& check : {avatar.held_out_check, avatar.left_out_check}) {
    EXPECT_GT(check.within_one, 0.5);
    EXPECT_LT(check.within_one, 0.85);
    EXPECT_GT(check.within_two, 0.8);
  }
  // Takes of one motion leave nothing to learn from once it is left out.
  TrainingFrames of_one = WavingTube::Frames(4, 40);
  for (TrainingTake& take : of_one.takes) take.motion = "wave";
  EXPECT_EQ(Learn(of_one).left_out_check.frames, 0);
}

TEST(SigmaCalibration, IsTheSameOnAnyNumberOfThreads) {
  const TrainingFrames frames = WavingTube::Frames(4, 40);
  SparseViewAvatar one, many;
  tbb::task_arena(1).execute([&] { one = Learn(frames); });
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 4);
  tbb::task_arena(4).execute([&] { many = Learn(frames); });
  EXPECT_EQ(one.sigma.of, many.sigma.of);
  EXPECT_EQ(one.held_out_check.within_one, many.held_out_check.within_one);
  EXPECT_EQ(one.left_out_check.loss, many.left_out_check.loss);
}

TEST(SigmaCalibration, WithTooFewFramesTypicalFactorsStandIn) {
  TrainingFrames frames = WavingTube::Frames(2, 30);
  for (TrainingTake& take : frames.takes) take.held_out = false, take.motion = "wave";
  const SparseViewAvatar avatar = Learn(frames);
  EXPECT_EQ(avatar.held_out_frames, 6);  // three of each: no run of any length
  EXPECT_EQ(avatar.held_out_check.frames, 0);
  EXPECT_EQ(avatar.sigma.of, TypicalSigmaScale().of);
  EXPECT_GT(avatar.sigma.of[1][1], 2);
}

TEST(SigmaCalibration, SigmaGrowsWhereTheClothDoesWhatItNeverDid) {
  const SparseViewAvatar avatar = Learn(WavingTube::Frames(4, 60));
  const Shares like_learnt = SharesOf(avatar, 1), bent_more = SharesOf(avatar, 4);
  EXPECT_GT(like_learnt.two, 0.85);
  EXPECT_GT(bent_more.two, 0.8);
  EXPECT_GT(bent_more.sigma_mm, 1.3 * like_learnt.sigma_mm);
}

// Factors of all numbers of cameras and rays, those of classes that hardly occur among them.
TEST(SigmaCalibration, FactorsStayAsTheyAre) {
  const Template garment = WavingTube::Garment();
  const AlignmentModel model(garment);
  SparseViewTraining training = kFewFrames;
  training.components = 3;
  const SparseViewAvatar avatar = *LearnSparseView(garment, WavingTube::Frames(3, 24), training);
  SigmaCalibration calibration(garment, model), other = calibration.Empty();
  std::vector<std::vector<Eigen::Vector3d>> run;
  for (int frame = 0; frame < 5; ++frame) run.push_back(WavingTube::At(frame, 9));
  ASSERT_TRUE(calibration.Add(avatar, run, 5).ok());
  EXPECT_EQ(calibration.frames(), 2);
  run.resize(4);
  ASSERT_TRUE(other.Add(avatar, run, 6).ok());
  EXPECT_EQ(other.frames(), 1);
  Recorded recorded;
  const auto record = [&](const SigmaCalibration& of) {
    const SigmaScale scales = of.Scales();
    std::vector<float> factors;
    for (const auto& row : scales.of) factors.insert(factors.end(), row.begin(), row.end());
    const SigmaCheck check = of.Check(scales);
    recorded.Add("factors", factors);
    recorded.Add("one", check.within_one);
    recorded.Add("two", check.within_two);
    recorded.Add("loss", check.loss);
  };
  record(calibration);
  record(other);
  calibration += other;
  EXPECT_EQ(calibration.frames(), 3);
  record(calibration);
  recorded.Expect();
  EXPECT_EQ(calibration.Check(TypicalSigmaScale()).frames, 3);
  EXPECT_EQ(calibration.Empty().Check(TypicalSigmaScale()).within_one, 0);
  EXPECT_EQ(calibration.Empty().Scales().of, TypicalSigmaScale().of);
  for (const NetGain& gain : calibration.gain()) EXPECT_EQ(gain.frames, 0);
  // A run that ends as tracking settles counts nothing.
  run.resize(2);
  ASSERT_TRUE(other.Add(avatar, run, 6).ok());
  EXPECT_EQ(other.frames(), 1);
}

}  // namespace
}  // namespace weft
