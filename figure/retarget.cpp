#include "figure/retarget.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/median.h"
#include "base/status_macros.h"
#include "figure/body_sides.h"
#include "figure/foreign_summary.h"
#include "figure/neutral_axes.h"

namespace weft {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

std::string NameOfAxis(const Vector3d& axis) {
  Eigen::Index k = 0;
  axis.cwiseAbs().maxCoeff(&k);
  return absl::StrCat(axis[k] < 0 ? "-" : "", std::string(1, static_cast<char>('x' + k)));
}

// How much the height of the lowest joint varies: little where `up` is up, since somebody stands or lies on
// the ground.
double SpreadOfLowest(const ForeignMotion& motion, const Vector3d& up) {
  std::vector<double> lowest;
  for (const ForeignMotion::Pose& pose : motion.poses) {
    double low = std::numeric_limits<double>::infinity();
    for (const Vector3d& at : PostureOf(motion, pose).at) low = std::min(low, up.dot(at));
    lowest.push_back(low);
  }
  constexpr double kLow = 0.05, kHigh = 0.95;
  return Quantile(lowest, kHigh) - Quantile(lowest, kLow);
}

class Retargeter {
 public:
  Retargeter(const ForeignMotion& from, const JointMatch& match) : from_(from), match_(match) {}

  absl::StatusOr<RetargetedMotion> Run(const RetargetOptions& options) {
    if (from_.poses.empty()) return absl::InvalidArgumentError("holds no pose");
    summary_ = Summarize(from_, match_);
    if (!(summary_.leg_length > 0) || !std::isfinite(summary_.leg_length))
      return absl::InvalidArgumentError("the legs have no length; are the offsets missing?");
    const std::optional<Matrix3d> standing = StandingAxes(from_, match_);
    WEFT_RETURN_IF_ERROR(FindUp(standing, options));
    if (options.check_sides) WEFT_RETURN_IF_ERROR(CheckSides(from_, match_, out_.notes));
    neutral_ = NeutralAxes(match_, summary_, standing);
    FindWorld();
    out_.motion.fps = from_.fps;
    for (const ForeignMotion::Pose& pose : from_.poses) out_.motion.poses.push_back(PoseFrom(pose));
    WEFT_RETURN_IF_ERROR(out_.motion.Validate());
    PlaceOnGround(out_.motion);
    WEFT_RETURN_IF_ERROR(out_.motion.Validate());
    out_.leg_length = summary_.leg_length;
    return std::move(out_);
  }

 private:
  int Of(Joint joint) const { return match_.of[static_cast<size_t>(joint)]; }

  // Where the poses stand; where they lie, crawl or tumble, as the rest pose stands.
  absl::Status FindUp(const std::optional<Matrix3d>& standing, const RetargetOptions& options) {
    constexpr double kParallel = 0.7;
    if (summary_.hips_along_body > kParallel)
      return absl::InvalidArgumentError(
          "no pose stands upright with legs side by side, which tells up from sideways; are hips and "
          "shoulders matched with the right joints (--joint OURS=THEIRS)?");
    if (options.up) {
      out_.up = NearestWorldAxis(*options.up);
      return absl::OkStatus();
    }
    const Vector3d of_poses = NearestWorldAxis(summary_.body);
    const double how_upright = summary_.body.dot(of_poses);
    if (!standing) {
      if (how_upright < kParallel)
        return absl::InvalidArgumentError(
            "neither its poses nor its rest pose stand upright, so nothing tells which axis is up; name it "
            "with "
            "--up AXIS");
      out_.up = of_poses;
      return absl::OkStatus();
    }
    const Vector3d of_rest =
        NearestWorldAxis(RotationAbovePelvis() * Vector3d(-standing->row(1).transpose()));
    out_.up = of_rest;
    if (of_rest.isApprox(of_poses) || how_upright < kParallel) return absl::OkStatus();
    // Either the world's axes are others than the rest pose's, or the person lies in most poses: then nothing
    // stands still along the body. A lowest foot moves by less than this share of a leg while somebody walks.
    constexpr double kUpright = 0.9, kSteps = 0.15;
    const double still = SpreadOfLowest(from_, of_rest), moved = SpreadOfLowest(from_, of_poses);
    const bool lies =
        std::abs(of_rest.dot(of_poses)) < 0.5 && moved > kSteps * summary_.leg_length && still < 0.5 * moved;
    if (how_upright > kUpright && !lies) out_.up = of_poses;
    out_.notes.push_back(absl::StrCat("most poses stand along ", NameOfAxis(of_poses),
                                      ", the rest pose along ", NameOfAxis(of_rest), "; ",
                                      NameOfAxis(out_.up), " was taken as up, --up AXIS takes another"));
    return absl::OkStatus();
  }

  // Of the joints above the pelvis at the first pose: they may turn the rest pose into the world.
  Quaterniond RotationAbovePelvis() const {
    const int parent = from_.joints[static_cast<size_t>(Of(Joint::kPelvis))].parent;
    if (parent < 0) return Quaterniond::Identity();
    return PostureOf(from_, from_.poses.front()).rotation[static_cast<size_t>(parent)];
  }

  // The rotation from the file's world to ours (x right, y down, a person looks towards -z), and the scale.
  void FindWorld() {
    const ForeignPosture first = PostureOf(from_, from_.poses.front());
    Vector3d side = first.at[static_cast<size_t>(Of(Joint::kRightThigh))] -
                    first.at[static_cast<size_t>(Of(Joint::kLeftThigh))];
    side -= side.dot(out_.up) * out_.up;
    side = NearestWorldAxis(side);
    if (std::abs(side.dot(out_.up)) > 0.5) side = Vector3d(out_.up.z(), out_.up.x(), out_.up.y());
    Matrix3d axes;
    axes.row(0) = side;
    axes.row(1) = -out_.up;
    axes.row(2) = side.cross(-out_.up);
    ours_from_theirs_ = Quaterniond(axes);
    const Skeleton skeleton = SkeletonOf(BodyShape());
    const bool has_ankles = match_.ankles[0] >= 0 && match_.ankles[1] >= 0;
    const double ours = (skeleton.At(Joint::kLeftThigh) - skeleton.At(Joint::kLeftShin)).norm() +
                        (has_ankles ? (skeleton.At(Joint::kLeftShin) - skeleton.left_ankle_mm).norm() : 0);
    scale_ = ours / summary_.leg_length;
  }

  FigurePose PoseFrom(const ForeignMotion::Pose& pose) const {
    const ForeignPosture posture = PostureOf(from_, pose);
    std::array<Quaterniond, kJoints> ours;
    for (size_t j = 0; j < kJoints; ++j) {
      if (match_.of[j] >= 0)
        ours[j] =
            AlongBone(posture, j,
                      ours_from_theirs_ * posture.rotation[static_cast<size_t>(match_.of[j])] * neutral_[j]);
      else
        ours[j] = ours[static_cast<size_t>(ParentOf(static_cast<Joint>(j)))];
    }
    // A trunk of one joint bends half way at the spine.
    if (Of(Joint::kSpine) < 0)
      ours[static_cast<size_t>(Joint::kSpine)] = ours[0].slerp(0.5, ours[static_cast<size_t>(Joint::kChest)]);
    FigurePose out;
    out.root_mm = scale_ * (ours_from_theirs_ * posture.at[static_cast<size_t>(Of(Joint::kPelvis))]);
    for (size_t j = 0; j < kJoints; ++j) {
      const auto parent = static_cast<size_t>(ParentOf(static_cast<Joint>(j)));
      out.rotation[j] = (j == 0 ? ours[0] : ours[parent].conjugate() * ours[j]).normalized();
    }
    return out;
  }

  // Limbs point where the joints are: bones of some files move against each other.
  Quaterniond AlongBone(const ForeignPosture& posture, size_t j, const Quaterniond& turned) const {
    if (!IsLimb(static_cast<Joint>(j)) || summary_.ends[j].empty() || !(summary_.bone[j].norm() > 0))
      return turned;
    const Vector3d bone = EndIn(posture, summary_.ends[j]) - posture.at[static_cast<size_t>(match_.of[j])];
    if (!(bone.norm() > 0)) return turned;
    return Quaterniond::FromTwoVectors(turned * Vector3d::UnitY(), ours_from_theirs_ * bone) * turned;
  }

  // Looks to the front at first, and the lower foot is on the ground at all but the lowest moments.
  static void PlaceOnGround(Motion& motion) {
    const Vector3d ahead = motion.poses.front().Of(Joint::kPelvis) * -Vector3d::UnitZ();
    const double heading = std::atan2(ahead.x(), -ahead.z());
    const Quaterniond turn(Eigen::AngleAxisd(heading, Vector3d::UnitY()));
    const Vector3d from = motion.poses.front().root_mm;
    const Skeleton skeleton = SkeletonOf(BodyShape());
    std::vector<double> lower;
    for (FigurePose& pose : motion.poses) {
      pose.root_mm = turn * Vector3d(pose.root_mm - from);
      pose.Of(Joint::kPelvis) = (turn * pose.Of(Joint::kPelvis)).normalized();
      const auto world = WorldFromRest(skeleton, pose);
      lower.push_back(
          std::max((world[static_cast<size_t>(Joint::kLeftShin)] * skeleton.left_ankle_mm).y(),
                   (world[static_cast<size_t>(Joint::kRightShin)] * skeleton.right_ankle_mm).y()));
    }
    constexpr double kRank = 0.95;
    const auto rank = static_cast<size_t>(kRank * static_cast<double>(lower.size() - 1));
    const double sink = skeleton.left_ankle_mm.y() - ValueAtRank(lower, rank);
    for (FigurePose& pose : motion.poses) pose.root_mm.y() += sink;
  }

  const ForeignMotion& from_;
  const JointMatch& match_;
  ForeignSummary summary_;
  std::array<Quaterniond, kJoints> neutral_;
  double scale_ = 1;
  Quaterniond ours_from_theirs_ = Quaterniond::Identity();
  RetargetedMotion out_;
};

}  // namespace

absl::StatusOr<RetargetedMotion> Retarget(const ForeignMotion& motion, const JointMatch& match,
                                          const RetargetOptions& options) {
  return Retargeter(motion, match).Run(options);
}

}  // namespace weft
