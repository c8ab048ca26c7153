#include "capture/rig/kalibr_yaml.h"

#include <Eigen/Core>
#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/rig/yaml_fields.h"
#include "capture/rig/yaml_lens.h"

namespace weft {
namespace {

// Kalibr: `before` is the camera of which T_cn_cnm1 tells the pose.
absl::StatusOr<CameraModel> ReadKalibrCamera(const YAML::Node& node, const std::string& id,
                                             const CameraModel* before, std::vector<std::string>& remarks) {
  CameraModel camera;
  camera.id = id;
  const YAML::Node model = YamlField(node, {"camera_model"}), lens = YamlField(node, {"distortion_model"});
  if (model.IsScalar() && model.Scalar() != "pinhole") {
    return absl::InvalidArgumentError(absl::StrCat(
        "the camera model ", model.Scalar(), " has no counterpart here; calibrate with a pinhole model"));
  }
  const auto k = YamlNumbers(YamlField(node, {"intrinsics"}), "intrinsics", 4);
  const auto size = YamlNumbers(YamlField(node, {"resolution"}), "resolution", 2);
  const auto distortion = YamlNumbers(YamlField(node, {"distortion_coeffs"}), "distortion_coeffs");
  for (const absl::Status& status : {k.status(), size.status(), distortion.status()})
    if (!status.ok()) return status;
  camera.fx_px = (*k)[0], camera.fy_px = (*k)[1], camera.cx_px = (*k)[2], camera.cy_px = (*k)[3];
  camera.width_px = static_cast<int>(std::clamp((*size)[0], 0.0, 1e6));
  camera.height_px = static_cast<int>(std::clamp((*size)[1], 0.0, 1e6));
  WEFT_RETURN_IF_ERROR(SetYamlLens(lens.IsScalar() ? lens.Scalar() : "", *distortion, camera, remarks));
  if (before == nullptr) return camera;
  WEFT_ASSIGN_OR_RETURN(const auto step, YamlNumbers(YamlField(node, {"T_cn_cnm1"}), "T_cn_cnm1", 16));
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> from_before(step.data());
  constexpr double kMmPerMetre = 1000;
  const Eigen::Matrix3d turn = from_before.topLeftCorner<3, 3>();
  camera.rotation = turn * before->rotation;
  camera.translation_mm = turn * before->translation_mm + kMmPerMetre * from_before.topRightCorner<3, 1>();
  return camera;
}

// Poses go from one camera to the next, so that a gap leaves the rest nowhere.
absl::Status CheckNoneFollows(const YAML::Node& root, size_t missing) {
  for (const auto& entry : root) {
    const std::string name = entry.first.IsScalar() ? entry.first.Scalar() : "";
    size_t index = 0;
    if (absl::StartsWith(name, "cam") && absl::SimpleAtoi(name.substr(3), &index) && index > missing)
      return absl::InvalidArgumentError(
          absl::StrCat("holds ", name, " and no cam", missing,
                       ": poses of Kalibr go from one camera to the next; number the cameras without a gap"));
  }
  return absl::OkStatus();
}

}  // namespace

bool IsKalibr(const YAML::Node& root) {
  const YAML::Node first = YamlField(root, {"cam0"});
  return first.IsMap() && !YamlField(first, {"intrinsics"}).IsNull();
}

absl::StatusOr<ForeignRig> ReadKalibr(const YAML::Node& root) {
  ForeignRig out;
  for (size_t i = 0;; ++i) {
    const std::string id = absl::StrCat("cam", i);
    const YAML::Node node = YamlField(root, {id.c_str()});
    if (node.IsNull()) {
      WEFT_RETURN_IF_ERROR(CheckNoneFollows(root, i));
      return out;
    }
    const CameraModel* before = i == 0 ? nullptr : &out.rig.cameras.back();
    absl::StatusOr<CameraModel> camera = ReadKalibrCamera(node, id, before, out.remarks);
    if (!camera.ok()) return absl::InvalidArgumentError(absl::StrCat(id, ": ", camera.status().message()));
    out.rig.cameras.push_back(*std::move(camera));
  }
}

}  // namespace weft
