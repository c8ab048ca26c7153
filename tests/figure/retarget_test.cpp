#include "figure/retarget.h"

#include <gtest/gtest.h>

#include "base/angles.h"

namespace weft {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

// A person in T pose, y up, looking towards +z, the left arm along +x; names as Mixamo's, lengths in cm.
ForeignMotion TPose(int poses = 1) {
  ForeignMotion out;
  out.fps = 30;
  const auto add = [&](const std::string& name, int parent, const Vector3d& offset) {
    out.joints.push_back({"mixamorig:" + name, parent, offset});
    return static_cast<int>(out.joints.size()) - 1;
  };
  const int hips = add("Hips", -1, {0, 0, 0});
  const int spine = add("Spine", hips, {0, 10, 0}), chest = add("Spine1", spine, {0, 20, 0});
  add("Head", chest, {0, 30, 0});
  for (const double side : {1.0, -1.0}) {
    const std::string name = side > 0 ? "Left" : "Right";
    const int shoulder = add(name + "Shoulder", chest, {5 * side, 15, 0});
    const int arm = add(name + "Arm", shoulder, {12 * side, 0, 0});
    const int forearm = add(name + "ForeArm", arm, {28 * side, 0, 0});
    const int hand = add(name + "Hand", forearm, {25 * side, 0, 0});
    add(name + "HandEnd", hand, {10 * side, 0, 0});
    const int thigh = add(name + "UpLeg", hips, {9 * side, -4, 0});
    const int shin = add(name + "Leg", thigh, {0, -41.5, 0});
    const int foot = add(name + "Foot", shin, {0, -41.5, 0});
    add(name + "ToeBase", foot, {0, -5, 12});
  }
  out.poses.resize(static_cast<size_t>(poses));
  for (ForeignMotion::Pose& pose : out.poses) {
    pose.root = {0, 90, 0};
    pose.rotation.assign(out.joints.size(), Quaterniond::Identity());
  }
  return out;
}

size_t IndexOf(const ForeignMotion& motion, const std::string& name) {
  for (size_t k = 0; k < motion.joints.size(); ++k)
    if (motion.joints[k].name == "mixamorig:" + name) return k;
  ADD_FAILURE() << name;
  return 0;
}

void Turn(ForeignMotion& motion, const std::string& name, double degrees, const Vector3d& axis) {
  motion.poses[0].rotation[IndexOf(motion, name)] = Eigen::AngleAxisd(kRadPerDeg * degrees, axis);
}

Motion Retargeted(const ForeignMotion& from) {
  const absl::StatusOr<JointMatch> match = MatchJoints(from);
  EXPECT_TRUE(match.ok()) << match.status();
  const absl::StatusOr<Motion> motion = Retarget(from, *match);
  EXPECT_TRUE(motion.ok()) << motion.status();
  return *motion;
}

// Where a bone points that hangs down at rest.
Vector3d Direction(const FigurePose& pose, Joint joint) {
  return WorldFromRest(SkeletonOf(BodyShape()), pose)[static_cast<size_t>(joint)].linear() *
         Vector3d::UnitY();
}

void ExpectNear(const Vector3d& a, const Vector3d& b) { EXPECT_LT((a - b).norm(), 1e-6) << a.transpose(); }

TEST(Retarget, ArmsOfATPosePointSideways) {
  const FigurePose pose = Retargeted(TPose()).poses[0];
  // Left in the file is on the side of +x, where the person looks towards -z.
  for (const Joint joint : {Joint::kRightUpperArm, Joint::kRightForearm, Joint::kRightHand})
    ExpectNear(Direction(pose, joint), {1, 0, 0});
  ExpectNear(Direction(pose, Joint::kLeftHand), {-1, 0, 0});
  ExpectNear(Direction(pose, Joint::kLeftShin), {0, 1, 0});
  ExpectNear(pose.root_mm, Vector3d::Zero());  // straight legs stand on the ground
  EXPECT_LT(pose.Of(Joint::kRightForearm).angularDistance(Quaterniond::Identity()), 1e-6);
}

TEST(Retarget, BonesPointWhereTheFilesPoint) {
  ForeignMotion from = TPose();
  Turn(from, "LeftArm", -90, Vector3d::UnitZ());      // hangs down
  Turn(from, "RightForeArm", 90, Vector3d::UnitY());  // forwards, along +z of the file
  Turn(from, "LeftLeg", 90, Vector3d::UnitX());       // the foot goes back
  const FigurePose pose = Retargeted(from).poses[0];
  EXPECT_LT(pose.Of(Joint::kRightUpperArm).angularDistance(Quaterniond::Identity()), 1e-6);
  ExpectNear(Direction(pose, Joint::kLeftForearm), {0, 0, -1});
  ExpectNear(Direction(pose, Joint::kRightShin), {0, 0, 1});
  ExpectNear(Direction(pose, Joint::kRightThigh), {0, 1, 0});
}

TEST(Retarget, BeginsInFrontAtTheScaleOfTheLegs) {
  ForeignMotion from = TPose(2);
  for (ForeignMotion::Pose& pose : from.poses) {
    pose.rotation[0] = Eigen::AngleAxisd(kRadPerDeg * 130, Vector3d::UnitY());
    pose.root += Vector3d(300, 0, -200);
  }
  // A step of 10 cm to where the person looks.
  from.poses[1].root += from.poses[1].rotation[0] * Vector3d(0, 0, 10);
  const Motion motion = Retargeted(from);
  ExpectNear(motion.poses[0].root_mm, Vector3d::Zero());
  ExpectNear(motion.poses[1].root_mm, {0, 0, -100});  // legs of 83 cm here and 830 mm there
  EXPECT_LT(motion.poses[1].Of(Joint::kPelvis).angularDistance(Quaterniond::Identity()), 1e-6);
}

TEST(Retarget, AnyAxisMayBeUp) {
  ForeignMotion from = TPose();
  Turn(from, "LeftArm", -50, Vector3d(0.3, 0.2, 1).normalized());
  Turn(from, "Spine1", 20, Vector3d(1, 1, 0).normalized());
  Turn(from, "Hips", 10, Vector3d(1, 0.5, 0).normalized());
  const FigurePose expected = Retargeted(from).poses[0];
  for (const Vector3d& axis : {Vector3d(1, 0, 0), Vector3d(0, 1, 0), Vector3d(0, 0, 1)}) {
    const Quaterniond turn(Eigen::AngleAxisd(kRadPerDeg * 90, axis));
    ForeignMotion turned = from;
    for (ForeignMotion::Joint& joint : turned.joints) joint.offset = turn * joint.offset;
    turned.poses[0].root = turn * turned.poses[0].root;
    for (Quaterniond& q : turned.poses[0].rotation) q = turn * q * turn.conjugate();
    const FigurePose pose = Retargeted(turned).poses[0];
    for (size_t j = 0; j < kJoints; ++j)
      EXPECT_LT(pose.rotation[j].angularDistance(expected.rotation[j]), 1e-6);
    ExpectNear(pose.root_mm, expected.root_mm);
  }
}

TEST(Retarget, AMissingJointFollowsItsParent) {
  ForeignMotion from = TPose();
  Turn(from, "Spine1", 40, Vector3d::UnitY());
  for (ForeignMotion::Joint& joint : from.joints)
    for (const char* name : {"Head", "LeftHand", "RightHand"})
      if (joint.name == "mixamorig:" + std::string(name)) joint.name += "X";
  const absl::StatusOr<JointMatch> match = MatchJoints(from);
  ASSERT_TRUE(match.ok()) << match.status();
  EXPECT_EQ(match->of[static_cast<size_t>(Joint::kHead)], -1);
  const FigurePose pose = Retarget(from, *match)->poses[0];
  EXPECT_LT(pose.Of(Joint::kHead).angularDistance(Quaterniond::Identity()), 1e-6);
  EXPECT_LT(pose.Of(Joint::kLeftHand).angularDistance(Quaterniond::Identity()), 1e-6);
}

TEST(MatchJoints, FindsChestAndClaviclesByTheArms) {
  const ForeignMotion motion = TPose();
  const absl::StatusOr<JointMatch> match = MatchJoints(motion);
  ASSERT_TRUE(match.ok()) << match.status();
  const auto of = [&](Joint joint) {
    return motion.joints[static_cast<size_t>(match->of[static_cast<size_t>(joint)])].name;
  };
  EXPECT_EQ(of(Joint::kChest), "mixamorig:Spine1");
  EXPECT_EQ(of(Joint::kSpine), "mixamorig:Spine");
  EXPECT_EQ(of(Joint::kRightClavicle), "mixamorig:LeftShoulder");
  EXPECT_EQ(of(Joint::kRightUpperArm), "mixamorig:LeftArm");
  EXPECT_EQ(of(Joint::kLeftThigh), "mixamorig:RightUpLeg");
}

TEST(MatchJoints, SaysWhatIsMissingAndTakesItByHand) {
  ForeignMotion motion = TPose();
  motion.joints[0].name = "Base";
  const absl::Status status = MatchJoints(motion).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(status.message().find("no joint was recognised as pelvis; its joints are Base, mixamorig:Spine"),
            std::string::npos)
      << status;
  EXPECT_EQ(MatchJoints(motion, {{"pelvis", "Base"}})->of[0], 0);
  EXPECT_NE(MatchJoints(motion, {{"pelvis", "Bass"}}).status().message().find("no joint called \"Bass\""),
            std::string::npos);
  EXPECT_NE(MatchJoints(motion, {{"tail", "Base"}}).status().message().find("\"tail\" is none of ours"),
            std::string::npos);
}

TEST(Retarget, RefusesRestPosesThatDoNotStand) {
  ForeignMotion flat = TPose();
  for (ForeignMotion::Joint& joint : flat.joints) joint.offset.setZero();
  EXPECT_NE(Retarget(flat, *MatchJoints(flat)).status().message().find("no length"), std::string::npos);
  ForeignMotion lying = TPose();
  for (ForeignMotion::Joint& joint : lying.joints)
    if (joint.name.ends_with("UpLeg")) joint.offset = {0, joint.offset.x(), 0};
  EXPECT_NE(Retarget(lying, *MatchJoints(lying)).status().message().find("upright"), std::string::npos);
}

}  // namespace
}  // namespace weft
