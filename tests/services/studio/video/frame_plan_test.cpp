#include "services/studio/video/frame_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace weft {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::Pointwise;

std::vector<double> Even(double first_s, double period_s, int count) {
  std::vector<double> times_s;
  for (int i = 0; i < count; ++i) times_s.push_back(first_s + period_s * i);
  return times_s;
}

TEST(PlanFrames, PutsFramesIntoTheNearestSet) {
  // The second camera films 1.3 frames later.
  const FramePlan plan = PlanFrames({Even(0, 0.04, 5), Even(0.052, 0.04, 4)});
  EXPECT_EQ(plan.reference, 0u);
  EXPECT_THAT(plan.set_times_s, Pointwise(DoubleNear(1e-9), Even(0, 0.04, 5)));
  EXPECT_THAT(plan.frames[0], ElementsAre(0, 1, 2, 3, 4));
  EXPECT_THAT(plan.frames[1], ElementsAre(-1, 0, 1, 2, 3));
  EXPECT_THAT(plan.left_out, ElementsAre(0, 0));
}

TEST(PlanFrames, CoversClipsThatBeginEarlierAndEndLater) {
  const FramePlan plan = PlanFrames({Even(0, 0.04, 6), Even(-0.083, 0.04, 4), Even(0.41, 0.04, 2)});
  EXPECT_EQ(plan.set_times_s.size(), 2u + 6u + 2u);
  EXPECT_THAT(plan.frames[0], ElementsAre(-1, -1, 0, 1, 2, 3, 4, 5, -1, -1));
  EXPECT_THAT(plan.frames[1], ElementsAre(0, 1, 2, 3, -1, -1, -1, -1, -1, -1));
  EXPECT_THAT(plan.frames[2], ElementsAre(-1, -1, -1, -1, -1, -1, -1, -1, 0, 1));
  EXPECT_THAT(plan.left_out, ElementsAre(0, 0, 0));
}

TEST(PlanFrames, FollowsTheSlowestCamera) {
  const FramePlan plan = PlanFrames({Even(0, 0.02, 8), Even(0.001, 0.04, 4)});
  EXPECT_EQ(plan.reference, 1u);
  EXPECT_THAT(plan.frames[0], ElementsAre(0, 2, 4, 6));
  EXPECT_THAT(plan.left_out, ElementsAre(4, 0));
}

TEST(PlanFrames, KeepsAVariableRate) {
  // The reference misses a frame, which the other camera has.
  const FramePlan plan = PlanFrames({{0, 0.04, 0.08, 0.16, 0.2}, {0.001, 0.041, 0.121, 0.161}});
  EXPECT_THAT(plan.set_times_s,
              Pointwise(DoubleNear(1e-9), std::vector<double>{0, 0.04, 0.08, 0.12, 0.16, 0.2}));
  EXPECT_THAT(plan.frames[0], ElementsAre(0, 1, 2, -1, 3, 4));
  EXPECT_THAT(plan.frames[1], ElementsAre(0, 1, -1, 2, 3, -1));
}

TEST(PlanFrames, OfCamerasThatAreAsSlowTheLongestLeads) {
  EXPECT_EQ(PlanFrames({Even(0, 0.04, 3), Even(0, 0.04, 5), Even(0, 0.04, 5)}).reference, 1u);
  // A percent is no difference.
  EXPECT_EQ(PlanFrames({Even(0, 0.04, 5), Even(0, 0.0403, 4)}).reference, 0u);
  EXPECT_EQ(PlanFrames({Even(0, 0.0403, 4), Even(0, 0.04, 5)}).reference, 1u);
  EXPECT_EQ(PlanFrames({Even(0, 0.04, 5), Even(0, 0.041, 4)}).reference, 1u);
  EXPECT_EQ(PlanFrames({Even(0, 0.041, 4), Even(0, 0.04, 5)}).reference, 0u);
}

TEST(PlanFrames, AFrameHalfwayGoesToTheEarlierSet) {
  const FramePlan plan = PlanFrames({Even(0, 0.04, 4), Even(0.02, 0.04, 3)});
  EXPECT_EQ(plan.set_times_s.size(), 4u);
  EXPECT_THAT(plan.frames[1], ElementsAre(0, 1, 2, -1));
  EXPECT_THAT(plan.left_out, ElementsAre(0, 0));
}

TEST(PlanFrames, OfTwoFramesTheNearerOneIsTaken) {
  // Set 1 at 40 ms: those at 30 and at 45 ms are both its own.
  const FramePlan plan = PlanFrames({Even(0, 0.04, 3), {0.015, 0.03, 0.045, 0.06}});
  EXPECT_EQ(plan.reference, 0u);
  EXPECT_THAT(plan.frames[1], ElementsAre(0, 2, -1));
  EXPECT_THAT(plan.left_out, ElementsAre(0, 2));
  const FramePlan later = PlanFrames({Even(0, 0.04, 3), {0.001, 0.036, 0.047, 0.08}});
  EXPECT_THAT(later.frames[1], ElementsAre(0, 1, 3));
  EXPECT_THAT(later.left_out, ElementsAre(0, 1));
}

TEST(PlanFrames, TakesWhateverThereIs) {
  EXPECT_TRUE(PlanFrames({}).set_times_s.empty());
  const FramePlan single = PlanFrames({{0.3}, {7.3}});
  EXPECT_EQ(single.set_times_s.size(), 2u);
  EXPECT_THAT(single.left_out, ElementsAre(0, 0));
}

}  // namespace
}  // namespace weft
