#include "figure/skeleton.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

TEST(Skeleton, JointsComeAfterTheirParentsAndAreFoundByName) {
  for (int j = 0; j < kJoints; ++j) {
    const auto joint = static_cast<Joint>(j);
    EXPECT_EQ(JointNamed(NameOf(joint)), joint);
    if (j > 0) {
      EXPECT_LT(ParentOf(joint), joint);
    }
  }
  EXPECT_EQ(JointNamed("tail"), std::nullopt);
}

TEST(Skeleton, IsSymmetricAndScalesWithTheBody) {
  const Skeleton average = SkeletonOf(BodyShape());
  const Eigen::Vector3d &left = average.At(Joint::kLeftHand), &right = average.At(Joint::kRightHand);
  EXPECT_LT((left - Eigen::Vector3d(-right.x(), right.y(), right.z())).norm(), 1e-12);

  BodyShape tall;
  tall.stature = 1.1;
  const Skeleton scaled = SkeletonOf(tall);
  for (size_t j = 0; j < kJoints; ++j) EXPECT_LT((scaled.rest_mm[j] - 1.1 * average.rest_mm[j]).norm(), 1e-9);

  BodyShape long_arms;
  long_arms.arm_length = 1.2;
  const Skeleton reaching = SkeletonOf(long_arms);
  EXPECT_NEAR((reaching.At(Joint::kLeftHand) - reaching.At(Joint::kLeftUpperArm)).norm(),
              1.2 * (average.At(Joint::kLeftHand) - average.At(Joint::kLeftUpperArm)).norm(), 1e-9);
  EXPECT_EQ(reaching.left_ankle_mm, average.left_ankle_mm);
}

TEST(BodyShape, FactorsOutOfRangeAreNamed) {
  BodyShape shape;
  EXPECT_TRUE(shape.Validate().ok());
  shape.waist_girth = 3;
  EXPECT_EQ(shape.Validate().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(shape.Validate().message().find("waist_girth is 3"), std::string::npos);
}

TEST(BodyShape, RandomPeopleDifferWithGirthsThatVaryTogether) {
  double waist_and_hip = 0, waist_and_stature = 0;
  constexpr int kPeople = 500;
  for (uint64_t seed = 0; seed < kPeople; ++seed) {
    const BodyShape shape = RandomBodyShape(seed);
    EXPECT_TRUE(shape.Validate().ok());
    EXPECT_EQ(shape, RandomBodyShape(seed));
    waist_and_hip += (shape.waist_girth - 1) * (shape.hip_girth - 1);
    waist_and_stature += (shape.waist_girth - 1) * (shape.stature - 1);
  }
  EXPECT_GT(waist_and_hip / kPeople, 0.002);  // 0.07 squared is 0.0049, less where factors are clamped
  EXPECT_LT(std::abs(waist_and_stature / kPeople), 0.0005);
}

}  // namespace
}  // namespace weft
