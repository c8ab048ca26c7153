#include "simulation/dataset_presets.h"

#include <gtest/gtest.h>

#include <set>

namespace weft {
namespace {

TEST(DatasetPresets, SplitsShareNoMotionAndTestsHaveClassesOfTheirOwn) {
  for (const DatasetPreset& preset : DatasetPresets()) {
    EXPECT_TRUE(CheckSplits(preset.takes).ok()) << CheckSplits(preset.takes);
    std::set<std::string> names;
    std::set<MotionKind> trained, unseen;
    for (const DatasetTake& take : preset.takes) {
      EXPECT_TRUE(names.insert(take.Name()).second) << take.Name();
      if (take.split == DatasetSplit::kTrain) trained.insert(take.motion);
      if (take.split == DatasetSplit::kTestUnseen) unseen.insert(take.motion);
    }
    EXPECT_EQ(trained.size(), 7u);
    EXPECT_EQ(unseen, (std::set{MotionKind::kSquat, MotionKind::kReach}));
  }
  EXPECT_NE(DatasetPresetNamed("shoes").status().message().find("shirt-drive"), std::string::npos);
}

TEST(DatasetPresets, LeaksAreRefused) {
  const auto message = [](std::vector<DatasetTake> takes) {
    return std::string(CheckSplits(takes).message());
  };
  const DatasetTake walk = {DatasetSplit::kTrain, MotionKind::kWalk, 5, 100};
  const DatasetTake squat = {DatasetSplit::kTestUnseen, MotionKind::kSquat, 6, 100};
  EXPECT_EQ(message({walk, squat}), "");
  EXPECT_NE(message({walk, {DatasetSplit::kTestKnown, MotionKind::kWalk, 5, 10}}).find("has the motion of"),
            std::string::npos);
  EXPECT_NE(message({squat, {DatasetSplit::kValidate, MotionKind::kSquat, 7, 10}}).find("of a class that"),
            std::string::npos);
  EXPECT_NE(message({walk, walk}).find("twice"), std::string::npos);
  EXPECT_EQ(message({walk, {DatasetSplit::kChaos, MotionKind::kWalk, 5, 100}}), "");
  EXPECT_NE(message({walk, {DatasetSplit::kChaos, MotionKind::kWalk, 6, 100}}).find("repeats no take"),
            std::string::npos);
}

TEST(DatasetPresets, ChaosDiffersInNothingButTheStep) {
  const DatasetPreset preset = *DatasetPresetNamed("tiny-drive");
  const SyntheticTakeOptions plain =
      *OptionsOf(preset, {DatasetSplit::kTestKnown, MotionKind::kTwist, 301, 10});
  const SyntheticTakeOptions chaos = *OptionsOf(preset, {DatasetSplit::kChaos, MotionKind::kTwist, 301, 10});
  EXPECT_EQ(plain.performance.step_s, 0);
  EXPECT_NEAR(chaos.performance.step_s, 0.9 * 0.002, 1e-9);
  EXPECT_EQ(plain.performance.seed, chaos.performance.seed);
  EXPECT_EQ(plain.performance.clip->poses[30].root_mm, chaos.performance.clip->poses[30].root_mm);
}

}  // namespace
}  // namespace weft
