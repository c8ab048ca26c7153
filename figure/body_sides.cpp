#include "figure/body_sides.h"

#include <Eigen/Geometry>
#include <cmath>
#include <optional>
#include <utility>

namespace weft {
namespace {

using Eigen::Vector3d;

constexpr std::pair<Joint, Joint> kJointsOfSides[] = {
    {Joint::kLeftClavicle, Joint::kRightClavicle}, {Joint::kLeftUpperArm, Joint::kRightUpperArm},
    {Joint::kLeftForearm, Joint::kRightForearm},   {Joint::kLeftHand, Joint::kRightHand},
    {Joint::kLeftThigh, Joint::kRightThigh},       {Joint::kLeftShin, Joint::kRightShin}};

// Sums over poses and legs; positive as persons are.
struct Evidence {
  double knees = 0, bend = 0;  // sines, with the side to which knees bend and without
  double toes = 0, feet = 0;   // of the length of a shin, forwards and in all
  double arms = 0;             // of each pose 1 or -1
  double legs = 0;             // how many
};

class Collector {
 public:
  Collector(const ForeignMotion& motion, const JointMatch& match) : motion_(motion), match_(match) {
    for (const ForeignMotion::Pose& pose : motion.poses) Add(PostureOf(motion, pose));
  }
  const Evidence& evidence() const { return out_; }

 private:
  Vector3d At(const ForeignPosture& posture, Joint joint) const {
    return posture.at[static_cast<size_t>(match_.of[static_cast<size_t>(joint)])];
  }

  void Add(const ForeignPosture& posture) {
    // Our right is the file's left (skeleton.h).
    const Vector3d left = At(posture, Joint::kRightThigh) - At(posture, Joint::kLeftThigh);
    const Vector3d arms = At(posture, Joint::kRightUpperArm) - At(posture, Joint::kLeftUpperArm);
    out_.arms += arms.dot(left) > 0 ? 1 : -1;
    for (const size_t side : {size_t{0}, size_t{1}}) {
      const int ankle = match_.ankles[side];
      if (ankle < 0) continue;
      const Vector3d hip = At(posture, side == 0 ? Joint::kLeftThigh : Joint::kRightThigh);
      const Vector3d knee = At(posture, side == 0 ? Joint::kLeftShin : Joint::kRightShin);
      AddLeg(hip, knee, posture.at[static_cast<size_t>(ankle)], left.normalized());
      AddFoot(posture, ankle, knee, left.normalized());
    }
  }

  void AddLeg(const Vector3d& hip, const Vector3d& knee, const Vector3d& ankle, const Vector3d& left) {
    const Vector3d bend = (knee - hip).normalized().cross((ankle - knee).normalized());
    out_.knees += bend.dot(left);
    out_.bend += bend.norm();
    ++out_.legs;
  }

  // Forwards is where the left side and the shin, upwards, say.
  void AddFoot(const ForeignPosture& posture, int ankle, const Vector3d& knee, const Vector3d& left) {
    const Vector3d at = posture.at[static_cast<size_t>(ankle)], shin = knee - at;
    if (!(shin.norm() > 0)) return;
    Vector3d toes = Vector3d::Zero();
    for (size_t k = 0; k < motion_.joints.size(); ++k) {
      if (motion_.joints[k].parent != ankle) continue;
      const Vector3d toe = posture.at[k] - at;
      if (toe.norm() > toes.norm()) toes = toe;
    }
    toes -= toes.dot(shin.normalized()) * shin.normalized();
    out_.toes += toes.dot(left.cross(shin.normalized())) / shin.norm();
    out_.feet += toes.norm() / shin.norm();
  }

  const ForeignMotion& motion_;
  const JointMatch& match_;
  Evidence out_;
};

// Of a sum and its size: whether it is as persons are; nothing where it is small or points anywhere.
std::optional<bool> SaysRight(double sum, double size, double count, double least) {
  constexpr double kClear = 0.5;
  if (count == 0 || size < least * count || std::abs(sum) < kClear * size) return std::nullopt;
  return sum > 0;
}

}  // namespace

JointMatch WithSidesExchanged(const JointMatch& match) {
  JointMatch out = match;
  for (const auto& [left, right] : kJointsOfSides)
    std::swap(out.of[static_cast<size_t>(left)], out.of[static_cast<size_t>(right)]);
  std::swap(out.ankles[0], out.ankles[1]);
  return out;
}

absl::Status CheckSides(const ForeignMotion& motion, const JointMatch& match,
                        std::vector<std::string>& notes) {
  const Evidence evidence = Collector(motion, match).evidence();
  // In the mean of poses: 3 degrees, and a fifth of a shin.
  constexpr double kLeastBend = 0.05, kLeastFoot = 0.2;
  if (evidence.arms < -0.5 * static_cast<double>(motion.poses.size()))
    return absl::InvalidArgumentError(
        "the arm called left is on the side of the leg called right; name joints with --joint OURS=THEIRS, "
        "or "
        "give --sides as-named where it is so");
  const auto knees = SaysRight(evidence.knees, evidence.bend, evidence.legs, kLeastBend);
  const auto toes = SaysRight(evidence.toes, evidence.feet, evidence.legs, kLeastFoot);
  const std::string remedy =
      "left and right seem to be exchanged, by a mirror or by names; --sides exchanged "
      "takes left as right, --sides as-named takes them as they are";
  if (knees == false && toes == false)
    return absl::InvalidArgumentError("knees bend forwards and toes point backwards: " + remedy);
  if (knees == false && !toes) notes.push_back("knees bend forwards: " + remedy);
  if (toes == false && !knees) notes.push_back("toes point backwards: " + remedy);
  return absl::OkStatus();
}

}  // namespace weft
