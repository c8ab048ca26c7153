#include "capture/rig/foreign_rig.h"

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/median.h"
#include "capture/file/plain_text.h"

namespace weft {
namespace {

// Two cameras have more than this between them, and a rig in metres, or in COLMAP's own unit, less.
constexpr double kLeastRigMm = 30;

// Another reading of the poses is meant where the axes meet so many times as closely, and this closely.
constexpr double kManyTimes = 3, kMeets = 0.3;

// Of the image: a principal point as far from the middle, in the median of the cameras, is said.
constexpr double kFarFromMiddle = 0.2;

double ExtentMm(const Rig& rig) {
  Eigen::AlignedBox3d box;
  for (const CameraModel& camera : rig.cameras) box.extend(camera.CenterWorld());
  return box.diagonal().norm();
}

// A garment fills the images from its hem to its collar. What they show less of is cloth on a table, or a rig
// in cm or inches: cameras at 2 m show 1 m of it, which are 100 or 39 such units. No cameras show more.
constexpr double kLeastFieldMm = 250, kMostFieldMm = 50'000;

// The point that is nearest to the axes of all cameras. None where these are nearly parallel.
std::optional<Eigen::Vector3d> MeetingPoint(const Rig& rig) {
  constexpr double kNearlyParallel = 0.01;  // least eigenvalue a camera: axes within 8 degrees of each other
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const CameraModel& camera : rig.cameras) {
    const Eigen::Vector3d axis = camera.rotation.row(2).transpose();
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - axis * axis.transpose();
    sum += across;
    right += across * camera.CenterWorld();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(sum);
  if (solver.eigenvalues()[0] < kNearlyParallel * static_cast<double>(rig.cameras.size()))
    return std::nullopt;
  return Eigen::Vector3d(sum.ldlt().solve(right));
}

// How far the axes pass from the point nearest to all of them, of how far that point is in front of the
// cameras. None where the axes are nearly parallel; infinite where the point is behind.
std::optional<double> Spread(const Rig& rig) {
  const std::optional<Eigen::Vector3d> meeting = MeetingPoint(rig);
  if (!meeting) return std::nullopt;
  const auto cameras = static_cast<double>(rig.cameras.size());
  double across2 = 0, depth = 0;
  for (const CameraModel& camera : rig.cameras) {
    const Eigen::Vector3d p = camera.rotation * *meeting + camera.translation_mm;
    across2 += p.head<2>().squaredNorm();
    depth += p.z();
  }
  if (!(depth > 0)) return std::numeric_limits<double>::infinity();
  return std::sqrt(across2 / cameras) / (depth / cameras);
}

// How much the longer side of the images shows there, in the median. None where axes do not meet.
std::optional<double> FieldMm(const Rig& rig) {
  const std::optional<double> spread = Spread(rig);
  if (!spread || *spread > kMeets) return std::nullopt;
  const Eigen::Vector3d meeting = *MeetingPoint(rig);
  std::vector<double> fields;
  for (const CameraModel& camera : rig.cameras) {
    const double depth = (camera.rotation * meeting + camera.translation_mm).z();
    fields.push_back(depth * std::max(camera.width_px / camera.fx_px, camera.height_px / camera.fy_px));
  }
  return Median(std::move(fields));
}

void Invert(CameraModel& camera) {
  const Eigen::Vector3d center = camera.translation_mm;
  camera.rotation.transposeInPlace();
  camera.translation_mm = -camera.rotation * center;
}

struct OtherReading {
  const char* meant;
  std::function<void(CameraModel&)> change;
};

const std::array<OtherReading, 2>& OtherReadings() {
  static const std::array<OtherReading, 2> readings = {{
      {"the poses seem to be world_from_camera", Invert},
      {"the cameras seem to look along -z, as OpenGL's and Blender's do, so y and z of each have to be "
       "turned",
       [](CameraModel& camera) {
         const Eigen::Vector3d turn(1, -1, -1);
         camera.rotation = turn.asDiagonal() * camera.rotation;
         camera.translation_mm = turn.asDiagonal() * camera.translation_mm;
       }},
  }};
  return readings;
}

absl::Status JudgePoses(const Rig& rig) {
  if (rig.cameras.size() < 3) return absl::OkStatus();
  const std::optional<double> spread = Spread(rig);
  if (!spread) return absl::OkStatus();
  for (const OtherReading& reading : OtherReadings()) {
    Rig other = rig;
    for (CameraModel& camera : other.cameras) reading.change(camera);
    const std::optional<double> other_spread = Spread(other);
    if (!other_spread || *other_spread > kMeets || kManyTimes * *other_spread > *spread) continue;
    return absl::InvalidArgumentError(absl::StrCat(
        "the axes of the cameras do not meet in front of them as camera_from_world; ", reading.meant,
        ". Give --poses world_from_camera, or --poses camera_from_world where they are right"));
  }
  return absl::OkStatus();
}

absl::Status JudgeUnit(const Rig& rig, std::vector<std::string>& remarks) {
  if (rig.cameras.size() < 2) return absl::OkStatus();
  const double extent_mm = ExtentMm(rig);
  if (extent_mm == 0) {
    remarks.push_back(
        absl::StrCat("all ", rig.cameras.size(), " cameras are at the same place; has the file no poses?"));
    return absl::OkStatus();
  }
  if (extent_mm < kLeastRigMm)
    return absl::InvalidArgumentError(
        absl::StrFormat("all cameras lie within %.3g mm of each other: lengths seem to be in another unit. "
                        "Give --unit m, cm, in or ft, or --mm-per-unit; --unit mm where they are right",
                        extent_mm));
  const std::optional<double> field_mm = FieldMm(rig);
  if (field_mm && (*field_mm < kLeastFieldMm || *field_mm > kMostFieldMm))
    remarks.push_back(absl::StrFormat(
        "where the cameras look at, %.3g mm fill their images: if lengths are in another unit "
        "than mm, give --unit cm, in, ft or m; --unit mm where they are right",
        *field_mm));
  return absl::OkStatus();
}

absl::Status JudgePrincipalPoints(const Rig& rig, std::vector<std::string>& remarks) {
  std::vector<double> from_left, from_top;
  for (const CameraModel& camera : rig.cameras) {
    if (!camera.Contains({camera.cx_px, camera.cy_px})) {
      return absl::InvalidArgumentError(
          absl::StrFormat("camera %s: the principal point %.1f, %.1f is outside the image of %d x %d px; "
                          "give the size of the images "
                          "that it was calibrated with",
                          camera.id, camera.cx_px, camera.cy_px, camera.width_px, camera.height_px));
    }
    from_left.push_back((camera.cx_px + 0.5) / camera.width_px);
    from_top.push_back((camera.cy_px + 0.5) / camera.height_px);
  }
  const double x = Median(std::move(from_left)), y = Median(std::move(from_top));
  if (std::abs(x - 0.5) > kFarFromMiddle || std::abs(y - 0.5) > kFarFromMiddle) {
    remarks.push_back(
        absl::StrFormat("the principal points are at %.0f %% of the width and %.0f %% of the height, in the "
                        "median; is the size of "
                        "the images that of the calibration, and width not exchanged for height?",
                        100 * x, 100 * y));
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status ForeignRig::Validate() const {
  for (const CameraModel& camera : rig.cameras) {
    if (IsPlainText(camera.id) && camera.id.find('/') == std::string::npos) continue;
    return absl::InvalidArgumentError(absl::StrCat(
        "the name \"", EscapedText(camera.id), "\" of a camera is no plain text without a slash; rename it"));
  }
  return rig.Validate();
}

void ApplyConvention(const PoseConvention& convention, Rig* rig) {
  for (CameraModel& camera : rig->cameras) {
    camera.translation_mm *= convention.mm_per_unit;
    if (convention.world_from_camera) Invert(camera);
  }
}

absl::Status JudgeRig(const RigJudgement& judgement, ForeignRig* rig) {
  absl::Status status = JudgePrincipalPoints(rig->rig, rig->remarks);
  if (status.ok() && judgement.judge_unit) status = JudgeUnit(rig->rig, rig->remarks);
  if (status.ok() && judgement.judge_poses) status = JudgePoses(rig->rig);
  return status;
}

}  // namespace weft
