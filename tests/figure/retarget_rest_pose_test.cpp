// One motion of joints in the world, written with other rest poses, axes, hierarchies and units.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "base/angles.h"
#include "figure/retarget.h"
#include "tests/figure/foreign_person.h"

namespace weft {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr int kWalkPoses = 30;

Quaterniond About(const Vector3d& axis, double degrees) {
  return Quaterniond(AngleAxisd(kRadPerDeg * degrees, axis));
}

ForeignMotion Walk() {
  ForeignMotion out = TPose(kWalkPoses);
  for (int f = 0; f < kWalkPoses; ++f) {
    ForeignMotion::Pose& pose = out.poses[static_cast<size_t>(f)];
    const double s = std::sin(2 * std::numbers::pi * f / 24);
    const auto turn = [&](const std::string& name, const Vector3d& axis, double degrees) {
      pose.rotation[IndexOf(out, name)] = About(axis, degrees);
    };
    pose.place[0] = {3 * std::sin(f / 5.0), 88 + s, 4.0 * f};
    turn("LeftArm", Vector3d::UnitZ(), -75);
    turn("RightArm", Vector3d::UnitZ(), 75);
    turn("LeftForeArm", Vector3d::UnitY(), -25);
    turn("RightForeArm", Vector3d::UnitY(), 25);
    turn("LeftUpLeg", Vector3d::UnitX(), -30 * s);
    turn("RightUpLeg", Vector3d::UnitX(), 30 * s);
    turn("LeftLeg", Vector3d::UnitX(), 20 + 20 * s);
    turn("RightLeg", Vector3d::UnitX(), 20 - 20 * s);
    turn("Spine", Vector3d::UnitX(), 5);
  }
  return out;
}

// The same joints in the world, with other axes at each joint: a rest pose of any form.
ForeignMotion WithAxes(ForeignMotion motion, const std::vector<Quaterniond>& axes) {
  const auto above = [&](size_t k) {
    const int parent = motion.joints[k].parent;
    return parent < 0 ? Quaterniond::Identity() : axes[static_cast<size_t>(parent)].conjugate();
  };
  for (size_t k = 0; k < motion.joints.size(); ++k) {
    motion.joints[k].offset = above(k) * motion.joints[k].offset;
    for (ForeignMotion::Pose& pose : motion.poses) pose.rotation[k] = above(k) * pose.rotation[k] * axes[k];
  }
  return motion;
}

// A root above the hips, which takes over what `root` says and leaves the rest to the hips.
ForeignMotion Below(const ForeignMotion& motion, const std::vector<std::pair<Vector3d, Quaterniond>>& root) {
  ForeignMotion out;
  out.fps = motion.fps;
  out.joints.push_back({"Reference", -1});
  out.joints[0].place = 0;
  for (ForeignMotion::Joint joint : motion.joints) {
    ++joint.parent;
    if (joint.place >= 0) ++joint.place;
    out.joints.push_back(joint);
  }
  for (size_t f = 0; f < motion.poses.size(); ++f) {
    const auto& [at, turn] = root[f];
    ForeignMotion::Pose pose;
    pose.place = {at, turn.conjugate() * (motion.poses[f].place[0] - at)};
    pose.rotation = {turn};
    pose.rotation.insert(pose.rotation.end(), motion.poses[f].rotation.begin(),
                         motion.poses[f].rotation.end());
    pose.rotation[1] = turn.conjugate() * pose.rotation[1];
    out.poses.push_back(pose);
  }
  return out;
}

// Children of a joint in another order, which changes all numbers of joints.
ForeignMotion Shuffled(const ForeignMotion& motion, std::mt19937_64& random) {
  std::vector<size_t> order, ready = {0};
  while (!ready.empty()) {
    std::swap(ready[random() % ready.size()], ready.back());
    const size_t k = ready.back();
    ready.pop_back();
    order.push_back(k);
    for (size_t c = 0; c < motion.joints.size(); ++c)
      if (motion.joints[c].parent == static_cast<int>(k)) ready.push_back(c);
  }
  ForeignMotion out = motion;
  for (size_t k = 0; k < order.size(); ++k) {
    out.joints[k] = motion.joints[order[k]];
    if (out.joints[k].parent >= 0)
      out.joints[k].parent = static_cast<int>(
          std::find(order.begin(), order.end(), static_cast<size_t>(out.joints[k].parent)) - order.begin());
    for (size_t f = 0; f < out.poses.size(); ++f)
      out.poses[f].rotation[k] = motion.poses[f].rotation[order[k]];
  }
  return out;
}

Motion Imported(const ForeignMotion& from) {
  const absl::StatusOr<JointMatch> match = MatchJoints(from);
  EXPECT_TRUE(match.ok()) << match.status();
  const absl::StatusOr<RetargetedMotion> motion = Retarget(from, *match);
  EXPECT_TRUE(motion.ok()) << motion.status();
  return motion.ok() ? motion->motion : Motion();
}

constexpr std::array kLimbs = {
    Joint::kLeftUpperArm,  Joint::kLeftForearm,  Joint::kLeftHand,  Joint::kLeftThigh,  Joint::kLeftShin,
    Joint::kRightUpperArm, Joint::kRightForearm, Joint::kRightHand, Joint::kRightThigh, Joint::kRightShin};

void ExpectSameMotion(const ForeignMotion& from, const std::string& what) {
  SCOPED_TRACE(what);
  const Motion expected = Imported(Walk()), motion = Imported(from);
  ASSERT_EQ(motion.poses.size(), expected.poses.size());
  double away = 0, limb = 0, turn = 0;
  for (size_t f = 0; f < motion.poses.size(); ++f) {
    away = std::max(away, (motion.poses[f].root_mm - expected.poses[f].root_mm).norm());
    for (const Joint joint : kLimbs)
      limb = std::max(limb, (Direction(motion.poses[f], joint) - Direction(expected.poses[f], joint)).norm());
    for (size_t j = 0; j < kJoints; ++j)
      turn = std::max(turn, motion.poses[f].rotation[j].angularDistance(expected.poses[f].rotation[j]));
  }
  EXPECT_LT(away, 1e-6);
  EXPECT_LT(limb, 1e-6);
  // Around themselves as well: this person is straight, so that what is neutral is the same either way.
  EXPECT_LT(turn, 1e-6);
}

// The truth itself: where joints are in the file's world, whose y and z are against ours.
TEST(RestPose, LimbsPointWhereTheJointsAre) {
  const ForeignMotion walk = Walk();
  const Motion motion = Imported(walk);
  const std::vector<std::pair<Joint, std::pair<std::string, std::string>>> bones = {
      {Joint::kRightUpperArm, {"LeftArm", "LeftForeArm"}},
      {Joint::kRightForearm, {"LeftForeArm", "LeftHand"}},
      {Joint::kLeftThigh, {"RightUpLeg", "RightLeg"}},
      {Joint::kLeftShin, {"RightLeg", "RightFoot"}},
  };
  for (size_t f = 0; f < walk.poses.size(); ++f) {
    const ForeignPosture posture = PostureOf(walk, walk.poses[f]);
    for (const auto& [joint, names] : bones) {
      const Vector3d bone =
          (posture.at[IndexOf(walk, names.second)] - posture.at[IndexOf(walk, names.first)]).normalized();
      EXPECT_LT((Direction(motion.poses[f], joint) - Vector3d(bone.x(), -bone.y(), -bone.z())).norm(), 1e-6);
    }
  }
  // 4 cm a pose with legs of 83 cm, against 830 mm.
  EXPECT_NEAR(motion.poses.back().root_mm.z(), -40.0 * (kWalkPoses - 1), 1e-6);
}

TEST(RestPose, MayBeAny) {
  std::mt19937_64 random(5);
  const size_t joints = Walk().joints.size();
  for (int k = 0; k < 20; ++k) {
    std::vector<Quaterniond> axes;
    for (size_t j = 0; j < joints; ++j) axes.push_back(Quaterniond::UnitRandom());
    ExpectSameMotion(Shuffled(WithAxes(Walk(), axes), random), "random axes " + std::to_string(k));
  }
  for (const Vector3d& axis : {Vector3d(1, 0, 0), Vector3d(0, 1, 0), Vector3d(0, 0, 1)})
    for (const double degrees : {-90.0, 90.0, 180.0})
      ExpectSameMotion(WithAxes(Walk(), std::vector<Quaterniond>(joints, About(axis, degrees))), "lying");
}

// Joints of a limb and all below are turned at rest.
TEST(RestPose, MayHaveLimbsAnywhere) {
  const auto expect = [](const std::vector<std::pair<std::string, Quaterniond>>& turns,
                         const std::string& what) {
    const ForeignMotion walk = Walk();
    std::vector<Quaterniond> axes(walk.joints.size(), Quaterniond::Identity());
    for (size_t k = 0; k < axes.size(); ++k) {
      if (walk.joints[k].parent >= 0) axes[k] = axes[static_cast<size_t>(walk.joints[k].parent)];
      for (const auto& [name, turn] : turns)
        if (k == IndexOf(walk, name)) axes[k] = axes[k] * turn;
    }
    ExpectSameMotion(WithAxes(walk, axes), what);
  };
  const Vector3d x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
  expect({{"LeftArm", About(z, 45)}, {"RightArm", About(z, -45)}}, "A pose");
  expect({{"LeftArm", About(z, 90)}, {"RightArm", About(z, -90)}}, "arms down");
  expect({{"LeftArm", About(y, 90)}, {"RightArm", About(y, -90)}}, "arms ahead");
  expect({{"RightArm", About(y, 180)}}, "both arms to one side");
  expect({{"LeftUpLeg", About(y, 90)}, {"RightUpLeg", About(y, -70)}}, "legs turned around themselves");
  expect({{"LeftUpLeg", About(x, 90)}, {"RightUpLeg", About(x, 90)}}, "sitting");
  expect({{"LeftUpLeg", About(z, 60)}}, "a leg lifted sideways");
}

TEST(RestPose, RootsAboveTheHipsMayMove) {
  std::vector<std::pair<Vector3d, Quaterniond>> still, moving, turning, all;
  for (int f = 0; f < kWalkPoses; ++f) {
    still.emplace_back(Vector3d(5, 6, 7), Quaterniond::Identity());
    moving.emplace_back(Vector3d(0, 0, 4.0 * f), Quaterniond::Identity());
    turning.emplace_back(Vector3d(10, 3, 4.0 * f), About(Vector3d::UnitY(), 7 * f));
    all.emplace_back(Walk().poses[static_cast<size_t>(f)].place[0], About(Vector3d::UnitX(), -90));
  }
  ExpectSameMotion(Below(Walk(), still), "still");
  ExpectSameMotion(Below(Walk(), moving), "moves");
  ExpectSameMotion(Below(Walk(), turning), "moves and turns");
  ExpectSameMotion(Below(Walk(), all), "all of the way, turned");
  std::vector<Quaterniond> axes;
  for (size_t j = 0; j < Walk().joints.size() + 1; ++j) axes.push_back(Quaterniond::UnitRandom());
  axes[0].setIdentity();
  ExpectSameMotion(WithAxes(Below(Walk(), turning), axes), "moves, any rest pose");
}

// The root turns a rest pose that stands along y into a world whose z is up.
TEST(RestPose, PosesSayWhatIsUp) {
  ForeignMotion from = Walk();
  const Quaterniond turn = About(Vector3d::UnitX(), 90);
  for (ForeignMotion::Pose& pose : from.poses) {
    pose.place[0] = turn * pose.place[0];
    pose.rotation[0] = turn * pose.rotation[0];
  }
  ExpectSameMotion(from, "z is up");
  const absl::StatusOr<RetargetedMotion> motion = Retarget(from, *MatchJoints(from));
  ASSERT_EQ(motion->notes.size(), 1u);
  EXPECT_NE(motion->notes[0].find("most poses stand along z, the rest pose along y; z was taken as up"),
            std::string::npos)
      << motion->notes[0];
  EXPECT_EQ(Retarget(from, *MatchJoints(from), {.up = Vector3d(0, 1, 0)})->up, Vector3d(0, 1, 0));
}

// Somebody who lies on the ground and moves the legs: the rest pose says what is up.
TEST(RestPose, TellsUpWhereThePersonLies) {
  ForeignMotion from = Walk();
  const Quaterniond turn = About(Vector3d::UnitX(), -90);
  for (size_t f = 0; f < from.poses.size(); ++f) {
    ForeignMotion::Pose& pose = from.poses[f];
    pose.place[0] = {0, 0, 0};
    pose.rotation[0] = turn;
    for (const std::string name : {"LeftLeg", "RightLeg", "LeftUpLeg", "RightUpLeg"})
      pose.rotation[IndexOf(from, name)] = Quaterniond::Identity();
    for (const std::string name : {"LeftUpLeg", "RightUpLeg"})
      pose.rotation[IndexOf(from, name)] = About(Vector3d::UnitX(), -2.0 * static_cast<double>(f));
    for (const std::string name : {"LeftFoot", "RightFoot"})
      pose.rotation[IndexOf(from, name)] = About(Vector3d::UnitX(), 2.0 * static_cast<double>(f));
  }
  EXPECT_EQ(Retarget(from, *MatchJoints(from))->up, Vector3d(0, 1, 0));
}

TEST(RestPose, NothingTellsUpWhereNothingStands) {
  std::vector<Quaterniond> axes(Walk().joints.size(), Quaterniond::Identity());
  for (size_t k = 1; k < axes.size(); ++k) axes[k] = Quaterniond::UnitRandom();
  ForeignMotion from = WithAxes(Walk(), axes);
  for (size_t f = 0; f < from.poses.size(); ++f)
    from.poses[f].rotation[0] = About(Vector3d::UnitY(), 24.0 * static_cast<double>(f)) *
                                About(Vector3d::UnitX(), 90) * from.poses[f].rotation[0];
  const absl::Status status = Retarget(from, *MatchJoints(from)).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(status.message().find("--up"), std::string::npos) << status;
}

}  // namespace
}  // namespace weft
