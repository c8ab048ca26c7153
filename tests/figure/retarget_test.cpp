#include "figure/retarget.h"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "base/angles.h"
#include "tests/figure/foreign_person.h"

namespace weft {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

void Turn(ForeignMotion& motion, const std::string& name, double degrees, const Vector3d& axis) {
  motion.poses[0].rotation[IndexOf(motion, name)] = Eigen::AngleAxisd(kRadPerDeg * degrees, axis);
}

Motion Retargeted(const ForeignMotion& from) {
  const absl::StatusOr<JointMatch> match = MatchJoints(from);
  EXPECT_TRUE(match.ok()) << match.status();
  const absl::StatusOr<RetargetedMotion> motion = Retarget(from, *match);
  EXPECT_TRUE(motion.ok()) << motion.status();
  return motion->motion;
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
    pose.place[0] += Vector3d(300, 0, -200);
  }
  // A step of 10 cm to where the person looks.
  from.poses[1].place[0] += from.poses[1].rotation[0] * Vector3d(0, 0, 10);
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
    turned.poses[0].place[0] = turn * turned.poses[0].place[0];
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
  const FigurePose pose = Retarget(from, *match)->motion.poses[0];
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

TEST(MatchJoints, KnowsTheNamesOfOtherPrograms) {
  const auto renamed = [](const std::vector<std::pair<std::string, std::string>>& names,
                          const std::string& before) {
    ForeignMotion out = TPose();
    for (ForeignMotion::Joint& joint : out.joints) {
      joint.name = joint.name.substr(std::string("mixamorig:").size());
      for (const auto& [from, to] : names)
        if (joint.name == from) {
          joint.name = to;
          break;
        }
      joint.name = before + joint.name;
    }
    return out;
  };
  const absl::StatusOr<JointMatch> expected = MatchJoints(TPose());
  ASSERT_TRUE(expected.ok());
  const auto expect_same = [&](const ForeignMotion& motion) {
    const absl::StatusOr<JointMatch> match = MatchJoints(motion);
    ASSERT_TRUE(match.ok()) << match.status();
    EXPECT_EQ(match->of, expected->of) << motion.joints[0].name;
    EXPECT_EQ(match->ankles, expected->ankles) << motion.joints[0].name;
  };
  for (const char* before : {"", "Bip01 ", "Character1_", "m_avg_", "Armature|mixamorig:"})
    expect_same(renamed({}, before));
  // 3ds Max: the joint at the top is called by the prefix alone in some files, here it is the pelvis.
  expect_same(renamed({{"Hips", "Pelvis"},
                       {"LeftShoulder", "L Clavicle"},
                       {"LeftArm", "L UpperArm"},
                       {"LeftForeArm", "L Forearm"},
                       {"LeftHand", "L Hand"},
                       {"LeftUpLeg", "L Thigh"},
                       {"LeftLeg", "L Calf"},
                       {"LeftFoot", "L Foot"},
                       {"RightShoulder", "R Clavicle"},
                       {"RightArm", "R UpperArm"},
                       {"RightForeArm", "R Forearm"},
                       {"RightHand", "R Hand"},
                       {"RightUpLeg", "R Thigh"},
                       {"RightLeg", "R Calf"},
                       {"RightFoot", "R Foot"}},
                      "Bip01 "));
  // SMPL.
  expect_same(renamed({{"Hips", "Pelvis"},
                       {"LeftShoulder", "L_Collar"},
                       {"LeftArm", "L_Shoulder"},
                       {"LeftForeArm", "L_Elbow"},
                       {"LeftHand", "L_Wrist"},
                       {"LeftHandEnd", "L_Hand"},
                       {"LeftUpLeg", "L_Hip"},
                       {"LeftLeg", "L_Knee"},
                       {"LeftFoot", "L_Ankle"},
                       {"LeftToeBase", "L_Foot"},
                       {"RightShoulder", "R_Collar"},
                       {"RightArm", "R_Shoulder"},
                       {"RightForeArm", "R_Elbow"},
                       {"RightHand", "R_Wrist"},
                       {"RightHandEnd", "R_Hand"},
                       {"RightUpLeg", "R_Hip"},
                       {"RightLeg", "R_Knee"},
                       {"RightFoot", "R_Ankle"},
                       {"RightToeBase", "R_Foot"}},
                      "f_avg_"));
}

// A clavicle that is called shoulder is no arm because the arm has an unknown name.
TEST(MatchJoints, RefusesLimbsThatMayBeginElsewhere) {
  ForeignMotion motion = TPose();
  const auto rename = [](ForeignMotion& in, const std::string& from, const std::string& to) {
    in.joints[IndexOf(in, from)].name = to;
  };
  rename(motion, "LeftArm", "Limb");
  const absl::Status status = MatchJoints(motion).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(status.message().find("right-upper-arm may be \"mixamorig:LeftShoulder\" or \"Limb\""),
            std::string::npos)
      << status;
  const absl::StatusOr<JointMatch> match = MatchJoints(motion, {{"right-upper-arm", "Limb"}});
  ASSERT_TRUE(match.ok()) << match.status();
  EXPECT_EQ(match->of, MatchJoints(TPose())->of);
  // A joint that turns the limb around itself is none that could be meant.
  rename(motion, "LeftShoulder", "mixamorig:LeftArm");
  motion.joints[IndexOf(motion, "LeftForeArm")].name = "LeftElbow";
  for (ForeignMotion::Joint& joint : motion.joints)
    if (joint.name == "Limb") joint.name = "LeftArmTwist";
  EXPECT_TRUE(MatchJoints(motion).ok()) << MatchJoints(motion).status();

  ForeignMotion leg = TPose();
  rename(leg, "RightUpLeg", "RightHip");
  rename(leg, "RightLeg", "Strut");
  rename(leg, "RightFoot", "RightKnee");
  EXPECT_NE(MatchJoints(leg).status().message().find("left-thigh may be"), std::string::npos);

  ForeignMotion elsewhere = TPose();
  elsewhere.joints[IndexOf(elsewhere, "LeftForeArm")].parent = 0;
  EXPECT_NE(MatchJoints(elsewhere).status().message().find("does not hang on"), std::string::npos);

  ForeignMotion twice = TPose();
  rename(twice, "LeftToeBase", "mixamorig:LeftArm");
  EXPECT_NE(MatchJoints(twice).status().message().find("two joints are called \"mixamorig:LeftArm\""),
            std::string::npos);
  EXPECT_NE(
      MatchJoints(TPose(), {{"head", "mixamorig:LeftArm"}}).status().message().find("matched with both"),
      std::string::npos);
}

TEST(Retarget, RefusesWhatDoesNotTellUp) {
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
