#include "evaluation/jitter.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

TEST(Jitter, EvenMotionHasNoneAndAShakeCountsTwice) {
  const std::vector<Eigen::Vector3d> a = {{0, 0, 0}, {1, 1, 1}}, b = {{1, 0, 0}, {1, 1, 1.5}},
                                     c = {{2, 0, 0}, {1, 1, 1}};
  const std::vector<double> found = SecondDifferences(a, b, c);
  EXPECT_EQ(found[0], 0);
  EXPECT_EQ(found[1], 1);
}

TEST(ErrorChanges, CountMotionThatTheTruthDoesNotHave) {
  const std::vector<Eigen::Vector3d> true_now = {{0, 0, 0}, {5, 5, 5}}, true_after = {{2, 0, 0}, {5, 5, 6}};
  // The first keeps its error while it moves; the second's turns round.
  const std::vector<Eigen::Vector3d> now = {{0, 1, 0}, {5, 5.5, 5}}, after = {{2, 1, 0}, {5, 4.5, 6}};
  const std::vector<double> found = ErrorChanges(now, true_now, after, true_after);
  EXPECT_EQ(found[0], 0);
  EXPECT_EQ(found[1], 1);
}

}  // namespace
}  // namespace weft
