#include "simulation/studio_rig.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/angles.h"
#include "base/status_macros.h"
#include "simulation/random.h"

namespace weft {
namespace {

// Rotation camera_from_world of a camera at `center` that looks at `aim`, its x axis horizontal but for
// `roll`.
Eigen::Matrix3d LookAt(const Eigen::Vector3d& center, const Eigen::Vector3d& aim, double roll_rad) {
  const Eigen::Vector3d z = (aim - center).normalized();
  const Eigen::Vector3d down(0, 1, 0);
  const Eigen::Vector3d x = down.cross(z).normalized();
  Eigen::Matrix3d rotation;
  rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  return Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix() * rotation;
}

}  // namespace

absl::Status StudioRigOptions::Validate() const {
  const auto bad = [](const char* field, double value, const char* expected) {
    return absl::InvalidArgumentError(
        absl::StrCat("studio rig: ", field, " is ", value, ", expected ", expected));
  };
  if (cameras < 1 || cameras > 10000) return bad("cameras", cameras, "1 to 10000");
  if (width_px < 16 || width_px > 65536) return bad("width_px", width_px, "16 to 65536");
  if (height_px < 16 || height_px > 65536) return bad("height_px", height_px, "16 to 65536");
  if (!(distance_mm > 0)) return bad("distance_mm", distance_mm, "a positive number");
  if (!(around_deg >= 0 && around_deg <= 360)) return bad("around_deg", around_deg, "0 to 360");
  if (!(std::abs(elevation_deg) <= 80)) return bad("elevation_deg", elevation_deg, "-80 to 80");
  if (!(around_variation_deg >= 0 && around_variation_deg <= 180))
    return bad("around_variation_deg", around_variation_deg, "0 to 180");
  if (!(elevation_variation_deg >= 0 && std::abs(elevation_deg) + elevation_variation_deg <= 85))
    return bad("elevation_variation_deg", elevation_variation_deg, "0 to 85, less elevation_deg");
  if (!(object_width_mm > 0)) return bad("object_width_mm", object_width_mm, "a positive number");
  if (!(object_height_mm > 0)) return bad("object_height_mm", object_height_mm, "a positive number");
  if (!(std::hypot(object_width_mm, object_height_mm) < distance_mm))
    return bad("distance_mm", distance_mm, "more than the object's size");
  if (!(fill > 0 && fill <= 2)) return bad("fill", fill, "0 to 2");
  if (!(focal_spread >= 0 && focal_spread <= 4)) return bad("focal_spread", focal_spread, "0 to 4");
  if (!(principal_point_shift >= 0 && principal_point_shift <= 0.5))
    return bad("principal_point_shift", principal_point_shift, "0 to 0.5");
  if (!(distortion >= 0 && distortion <= 0.3)) return bad("distortion", distortion, "0 to 0.3");
  return absl::OkStatus();
}

absl::StatusOr<Rig> MakeStudioRig(const std::string& id, const StudioRigOptions& options) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  const StudioRigOptions& o = options;
  const bool circle = o.around_deg >= 360;
  Rig rig;
  rig.id = id;
  for (int i = 0; i < o.cameras; ++i) {
    const uint64_t key = KeyOf(o.seed, absl::StrCat("camera", i));
    const auto vary = [key](uint64_t k) { return 2 * UniformOf(key, k) - 1; };  // -1 to 1
    const double steps = circle ? o.cameras : std::max(1, o.cameras - 1);
    const double from = circle ? 0 : -o.around_deg / 2;
    const double around = (from + o.around_deg * i / steps + o.around_variation_deg * vary(0)) * kRadPerDeg;
    const double up =
        ((i % 2 == 0 ? 1 : -1) * o.elevation_deg + o.elevation_variation_deg * vary(1)) * kRadPerDeg;
    const double distance = o.distance_mm * (1 + 0.1 * vary(2));
    const Eigen::Vector3d center =
        o.aim_mm + distance * Eigen::Vector3d(std::cos(up) * std::sin(around), -std::sin(up),
                                              -std::cos(up) * std::cos(around));
    CameraModel camera;
    camera.id = absl::StrFormat("c%02d", i);
    camera.width_px = o.width_px, camera.height_px = o.height_px;
    camera.rotation =
        LookAt(center, o.aim_mm + 5 * Eigen::Vector3d(vary(3), vary(4), vary(5)), 3 * kRadPerDeg * vary(6));
    camera.translation_mm = -camera.rotation * center;
    // The shortest lens shows the whole object at `fill`; the nearer side of the object counts.
    const double depth = distance - o.object_width_mm / 2;
    const double fit =
        o.fill * depth * std::min(o.width_px / o.object_width_mm, o.height_px / o.object_height_mm);
    camera.fx_px = fit * (1 + o.focal_spread * UniformOf(key, 7));
    camera.fy_px = camera.fx_px * (1 + 0.001 * vary(8));
    camera.cx_px = (o.width_px - 1) / 2.0 + o.principal_point_shift * o.width_px * vary(9);
    camera.cy_px = (o.height_px - 1) / 2.0 + o.principal_point_shift * o.height_px * vary(10);
    camera.distortion = {-o.distortion * (0.5 + 0.5 * UniformOf(key, 11)),
                         1.5 * o.distortion * vary(12),
                         0.01 * o.distortion * vary(13),
                         0.01 * o.distortion * vary(14),
                         0,
                         0,
                         0,
                         0};
    rig.cameras.push_back(camera);
  }
  WEFT_RETURN_IF_ERROR(rig.Validate());
  return rig;
}

Eigen::Vector3d AimOf(const Rig& rig) {
  Eigen::Matrix3d normal = 1e-9 * Eigen::Matrix3d::Identity();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const CameraModel& camera : rig.cameras) {
    const std::optional<Ray> ray =
        camera.PixelRay({(camera.width_px - 1) / 2.0, (camera.height_px - 1) / 2.0});
    if (!ray) continue;
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - ray->direction * ray->direction.transpose();
    normal += across;
    right += across * ray->origin_mm;
  }
  return normal.ldlt().solve(right);
}

absl::StatusOr<Rig> CropRig(const Rig& rig, const Eigen::AlignedBox3d& box_mm) {
  constexpr int kLeastPx = 64;
  constexpr int kSteps = 8;  // distortion bends the box's faces, so points spread over them are projected
  Rig out;
  out.id = rig.id + "-cropped";
  for (const CameraModel& camera : rig.cameras) {
    Eigen::AlignedBox2d seen;
    for (int k = 0; k < (kSteps + 1) * (kSteps + 1) * (kSteps + 1); ++k) {
      const Eigen::Array3d share(k % (kSteps + 1), k / (kSteps + 1) % (kSteps + 1),
                                 k / ((kSteps + 1) * (kSteps + 1)));
      const Eigen::Vector3d point = box_mm.min().array() + share / kSteps * box_mm.sizes().array();
      if (const auto pixel = camera.Project(point)) seen.extend(*pixel);
    }
    if (seen.isEmpty()) continue;
    const auto left = static_cast<int>(std::max(0.0, std::floor(seen.min().x())));
    const auto top = static_cast<int>(std::max(0.0, std::floor(seen.min().y())));
    const auto right = static_cast<int>(std::min(camera.width_px - 1.0, std::ceil(seen.max().x())));
    const auto bottom = static_cast<int>(std::min(camera.height_px - 1.0, std::ceil(seen.max().y())));
    if (right - left + 1 < kLeastPx || bottom - top + 1 < kLeastPx) continue;
    CameraModel cropped = camera;
    cropped.width_px = right - left + 1, cropped.height_px = bottom - top + 1;
    cropped.cx_px -= left, cropped.cy_px -= top;
    out.cameras.push_back(cropped);
  }
  if (out.cameras.empty())
    return absl::InvalidArgumentError(
        absl::StrCat("rig ", rig.id, ": no camera shows the garment; are its translations in mm?"));
  return out;
}

}  // namespace weft
