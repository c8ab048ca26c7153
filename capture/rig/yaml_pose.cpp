#include "capture/rig/yaml_pose.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/rig/yaml_fields.h"

namespace weft {
namespace {

constexpr const char* kRotations[] = {"R", "rotation_matrix", "rotation", "rvec", "rotation_vector"};
constexpr const char* kTranslations[] = {"T", "translation_vector", "translation", "tvec"};
constexpr const char* kCameraFromWorld[] = {"extrinsic_matrix",
                                            "extrinsics_matrix",
                                            "extrinsic",
                                            "extrinsics",
                                            "camera_from_world",
                                            "world_to_camera",
                                            "world2cam",
                                            "w2c",
                                            "RT",
                                            "T_cam_world",
                                            "T_cw"};
constexpr const char* kWorldFromCamera[] = {
    "world_from_camera", "camera_to_world", "cam2world", "c2w", "T_world_cam", "T_wc"};

struct NamedField {
  std::string name;  // as in the file; empty where there is none
  YAML::Node node;
};

template <size_t kCount>
NamedField FindField(const YAML::Node& fields, const char* const (&names)[kCount]) {
  for (const char* name : names)
    if (const YAML::Node node = YamlField(fields, {name}); node.IsSequence() || node.IsMap())
      return {YamlSpelling(fields, {name}), node};
  return {"", YAML::Node(YAML::NodeType::Null)};
}

absl::Status SetRotation(const NamedField& field, CameraModel& camera) {
  WEFT_ASSIGN_OR_RETURN(const auto turn, YamlNumbers(field.node, field.name));
  const std::string key = YamlKey(field.name);
  if (turn.size() == 3 && key != "rotation" && key != "rotationmatrix") {  // cv::Rodrigues
    const Eigen::Vector3d rodrigues(turn.data());
    if (rodrigues.norm() > 0)
      camera.rotation = Eigen::AngleAxisd(rodrigues.norm(), rodrigues.normalized()).toRotationMatrix();
    return absl::OkStatus();
  }
  if (turn.size() == 3)
    return absl::InvalidArgumentError(absl::StrCat(
        "the field ", field.name, " has 3 numbers, which may be angles; call it rvec where it is Rodrigues' ",
        "vector in radians, or write the nine numbers of the matrix"));
  WEFT_ASSIGN_OR_RETURN(const auto nine, YamlNumbers(field.node, field.name, 9));
  for (int i = 0; i < 9; ++i) camera.rotation(i / 3, i % 3) = nine[i];
  return absl::OkStatus();
}

// [R | T], with or without a last row 0 0 0 1.
absl::Status SetPoseMatrix(const NamedField& field, bool is_inverse, CameraModel& camera) {
  WEFT_ASSIGN_OR_RETURN(const auto m, YamlNumbers(field.node, field.name));
  const bool is_full = m.size() == 16;
  if (!is_full && m.size() != 12)
    return absl::InvalidArgumentError(absl::StrCat("the field ", field.name, " has ", m.size(),
                                                   " numbers, expected 3x4 or 4x4 of [R | T]"));
  if (is_full && (m[12] != 0 || m[13] != 0 || m[14] != 0 || m[15] != 1))
    return absl::InvalidArgumentError(
        absl::StrCat("the field ", field.name, " does not end with the row 0 0 0 1; is it transposed?"));
  for (int row = 0; row < 3; ++row) {
    for (int col = 0; col < 3; ++col) camera.rotation(row, col) = m[4 * row + col];
    camera.translation_mm[row] = m[4 * row + 3];
  }
  if (!is_inverse) return absl::OkStatus();
  camera.rotation.transposeInPlace();
  camera.translation_mm = -camera.rotation * Eigen::Vector3d(camera.translation_mm);
  return absl::OkStatus();
}

// A field that is a pose by its name.
std::string UnreadPose(const YAML::Node& fields) {
  constexpr std::array kWords = {"pose",        "extrinsic",  "transform",  "rotation",
                                 "translation", "position",   "quaternion", "orientation",
                                 "euler",       "camtoworld", "worldtocam"};
  for (const auto& entry : fields) {
    if (!entry.first.IsScalar() || entry.second.IsNull()) continue;
    const std::string key = YamlKey(entry.first.Scalar());
    // OpenCV's calibration program writes where the board was in each picture.
    if (key == "extrinsicparameters" || entry.second.IsScalar()) continue;
    for (const char* word : kWords)
      if (absl::StrContains(key, word)) return entry.first.Scalar();
  }
  return "";
}

absl::Status IsUnread(const std::string& field) {
  return absl::InvalidArgumentError(absl::StrCat(
      "the field ", field, " seems to be its pose, in a form that is not read; write R (3x3) and T (3 ",
      "numbers) of camera_from_world, or extrinsic_matrix (3x4 or 4x4)"));
}

// ROS: R turns to the rectified image, and P has the distance of a stereo pair.
void RemarkRectification(const YAML::Node& fields, CameraModel& camera, std::vector<std::string>& remarks) {
  constexpr double kTurns = 1e-6;
  const auto r = YamlNumbers(YamlField(fields, {"R", "rectification_matrix"}), "R");
  const auto p = YamlNumbers(YamlField(fields, {"P", "projection_matrix"}), "P");
  bool moves = p.ok() && p->size() == 12 && (*p)[3] != 0;
  for (size_t i = 0; r.ok() && r->size() == 9 && i < 9; ++i)
    moves |= std::abs((*r)[i] - (i % 4 == 0 ? 1 : 0)) > kTurns;
  if (!moves) return;
  remarks.push_back(absl::StrCat(
      "camera ", camera.id, ": R and P rectify a stereo pair and are not used; its file has no pose, so ",
      "the camera is at the world's origin. Add R and T of camera_from_world, and ", "leave P out"));
}

}  // namespace

absl::Status SetYamlPose(const YAML::Node& fields, CameraModel& camera, std::vector<std::string>& remarks) {
  const NamedField from_world = FindField(fields, kCameraFromWorld),
                   from_camera = FindField(fields, kWorldFromCamera);
  const NamedField r = FindField(fields, kRotations), t = FindField(fields, kTranslations);
  if (const YAML::Node& map = from_world.node; map.IsMap() && YamlField(map, {"data"}).IsNull()) {
    if (FindField(map, kRotations).name.empty() && FindField(map, kTranslations).name.empty())
      return IsUnread(from_world.name);
    return SetYamlPose(map, camera, remarks);
  }
  if (!from_world.name.empty() && !from_camera.name.empty())
    return absl::InvalidArgumentError(
        absl::StrCat("the fields ", from_world.name, " and ", from_camera.name, " are two poses; leave one"));
  if (!from_world.name.empty()) return SetPoseMatrix(from_world, false, camera);
  if (!from_camera.name.empty()) return SetPoseMatrix(from_camera, true, camera);
  const bool is_ros = !YamlField(fields, {"P", "projection_matrix"}).IsNull() && t.name.empty();
  if (is_ros && (r.name.empty() || YamlKey(r.name) == "r")) {
    RemarkRectification(fields, camera, remarks);
    return absl::OkStatus();
  }
  if (r.name.empty() && t.name.empty()) {
    const std::string unread = UnreadPose(fields);
    return unread.empty() ? absl::OkStatus() : IsUnread(unread);
  }
  if (r.name.empty())
    return absl::InvalidArgumentError(absl::StrCat("the field R is missing beside ", t.name));
  if (t.name.empty())
    return absl::InvalidArgumentError(absl::StrCat("the field T is missing beside ", r.name));
  WEFT_ASSIGN_OR_RETURN(const auto shift, YamlNumbers(t.node, t.name, 3));
  for (int i = 0; i < 3; ++i) camera.translation_mm[i] = shift[i];
  return SetRotation(r, camera);
}

}  // namespace weft
