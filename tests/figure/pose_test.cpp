#include "figure/pose.h"

#include <gtest/gtest.h>

#include <cmath>

namespace weft {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

TEST(FigurePose, RestMovesNothingButTheRoot) {
  const Skeleton skeleton = SkeletonOf(BodyShape());
  FigurePose pose;
  pose.root_mm = {10, 20, 30};
  for (const Eigen::Isometry3d& world : WorldFromRest(skeleton, pose))
    EXPECT_LT((world * Vector3d(1, 2, 3) - Vector3d(11, 22, 33)).norm(), 1e-12);
}

TEST(FigurePose, JointsTurnWhatHangsOnThem) {
  const Skeleton skeleton = SkeletonOf(BodyShape());
  FigurePose pose;
  pose.Of(Joint::kLeftUpperArm) =
      Quaterniond(AngleAxisd(std::acos(0), Vector3d::UnitZ()));  // y down goes to -x
  const auto world = WorldFromRest(skeleton, pose);
  const Vector3d shoulder = skeleton.At(Joint::kLeftUpperArm), elbow = skeleton.At(Joint::kLeftForearm);
  const double length = (elbow - shoulder).norm();
  EXPECT_LT(
      (world[static_cast<size_t>(Joint::kLeftForearm)] * elbow - (shoulder - Vector3d(length, 0, 0))).norm(),
      1e-9);
  EXPECT_LT((world[static_cast<size_t>(Joint::kRightHand)] * elbow - elbow).norm(), 1e-12);
}

TEST(FigurePose, BonesKeepTheirLengthsInAnyPose) {
  const Skeleton skeleton = SkeletonOf(BodyShape());
  FigurePose pose;
  for (size_t j = 0; j < kJoints; ++j)
    pose.rotation[j] =
        Quaterniond(AngleAxisd(0.3 + 0.2 * static_cast<double>(j), Vector3d(1, -2, 0.5).normalized()));
  const auto world = WorldFromRest(skeleton, pose);
  for (int j = 1; j < kJoints; ++j) {
    const auto joint = static_cast<Joint>(j), parent = ParentOf(joint);
    const Vector3d a = world[static_cast<size_t>(parent)] * skeleton.At(parent);
    const Vector3d b = world[static_cast<size_t>(joint)] * skeleton.At(joint);
    EXPECT_NEAR((a - b).norm(), (skeleton.At(parent) - skeleton.At(joint)).norm(), 1e-9) << NameOf(joint);
  }
}

TEST(FigurePose, MixesAlongTheShortestTurn) {
  FigurePose a, b;
  b.Of(Joint::kChest) = Quaterniond(AngleAxisd(1, Vector3d::UnitY()));
  b.Of(Joint::kChest).coeffs() *= -1;  // the same turn
  b.root_mm = {4, 0, 0};
  const FigurePose half = Mix(a, b, 0.5);
  EXPECT_NEAR(half.Of(Joint::kChest).angularDistance(Quaterniond::Identity()), 0.5, 1e-12);
  EXPECT_EQ(half.root_mm.x(), 2);
}

}  // namespace
}  // namespace weft
