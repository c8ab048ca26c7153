#include "triangulation/rolled_observations.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace weft {
namespace {

constexpr double kMoment_s = 0.4;

// A node's pixel: it moves evenly, and nodes beside each other alike.
Observation ObservedNode(int row, int col, double time_s) {
  return {100 + 8.0 * col + (300 + 2 * row) * time_s,
          50 + 8.0 * row - (120 - col) * time_s,
          {row, col, NodeKind::kCenter},
          0.1f,
          0.99f};
}

SeenAt View(double time_s) {
  SeenAt seen{time_s, {}};
  for (int row = 0; row < 10; ++row)
    for (int col = 0; col < 10; ++col)
      seen.observations.push_back(ObservedNode(row, col, kMoment_s + time_s));
  return seen;
}

TEST(RolledObservations, AreWhereTheirNodesWereAtTheMoment) {
  for (const auto& [own_s, other_s] : {std::pair{0.012, -0.021}, {-0.004, 0.029}, {0.0, 0.033}}) {
    const std::vector<Observation> rolled = RollToMoment(View(own_s), View(other_s));
    ASSERT_EQ(rolled.size(), 100u);
    for (const Observation& seen : rolled) {
      const Observation truth = ObservedNode(seen.node.row, seen.node.col, kMoment_s);
      EXPECT_NEAR(seen.x_px, truth.x_px, 1e-9);
      EXPECT_NEAR(seen.y_px, truth.y_px, 1e-9);
      EXPECT_LE(seen.sigma_px, 0.1f);
      EXPECT_EQ(seen.confidence, 0.99f);
    }
  }
}

TEST(RolledObservations, OfTwoHalvesHaveTheNoiseOfTheirMean) {
  for (const Observation& seen : RollToMoment(View(0.01), View(-0.01)))
    EXPECT_NEAR(seen.sigma_px, 0.1 / std::sqrt(2), 1e-6);
}

TEST(RolledObservations, ThatTheOtherFrameLacksMoveWithTheirNeighbors) {
  SeenAt other = View(-0.02);
  std::erase_if(other.observations, [](const Observation& seen) { return seen.node.row == 4; });
  const std::vector<Observation> rolled = RollToMoment(View(0.013), other);
  ASSERT_EQ(rolled.size(), 100u);
  for (const Observation& seen : rolled) {
    const Observation truth = ObservedNode(seen.node.row, seen.node.col, kMoment_s);
    EXPECT_NEAR(seen.x_px, truth.x_px, 0.03);
    EXPECT_NEAR(seen.y_px, truth.y_px, 0.03);
    EXPECT_GE(seen.sigma_px, seen.node.row == 4 ? 0.1f : 0.05f);
  }
}

TEST(RolledObservations, WithoutNeighborsAreLeftOut) {
  SeenAt other = View(-0.02);
  std::erase_if(other.observations, [](const Observation& seen) { return seen.node.row < 5; });
  const std::vector<Observation> rolled = RollToMoment(View(0.013), other);
  for (const Observation& seen : rolled) EXPECT_GE(seen.node.row, 3);
  EXPECT_EQ(rolled.size(), 70u);
  EXPECT_TRUE(RollToMoment(View(0.01), {-0.02, {}}).empty());
}

}  // namespace
}  // namespace weft
