#include "capture/rig/opencv_yaml.h"

#include <yaml-cpp/yaml.h>

#include <opencv2/core.hpp>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "base/status_macros.h"
#include "capture/rig/kalibr_yaml.h"
#include "capture/rig/yaml_fields.h"
#include "capture/rig/yaml_lens.h"
#include "capture/rig/yaml_pose.h"

namespace weft {
namespace {

absl::Status SetSize(const YAML::Node& node, CameraModel& camera) {
  const std::pair<const char*, int*> fields[] = {{"width", &camera.width_px}, {"height", &camera.height_px}};
  for (const auto& [name, value] : fields) {
    const YAML::Node field = YamlField(node, {absl::StrCat("image_", name).c_str(), name});
    if (!field.IsScalar() || !absl::SimpleAtoi(field.Scalar(), value)) {
      return absl::InvalidArgumentError(absl::StrCat("the field image_", name, " is missing or no integer"));
    }
  }
  return absl::OkStatus();
}

absl::Status SetMatrix(const YAML::Node& node, CameraModel& camera) {
  WEFT_ASSIGN_OR_RETURN(const auto k,
                        YamlNumbers(YamlField(node, {"camera_matrix", "K"}), "camera_matrix", 9));
  if (k[1] != 0 || k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1) {
    return absl::InvalidArgumentError(
        "camera_matrix has skew or is not normalised; expected fx 0 cx / 0 fy cy / 0 0 1");
  }
  camera.fx_px = k[0], camera.cx_px = k[2], camera.fy_px = k[4], camera.cy_px = k[5];
  return absl::OkStatus();
}

absl::StatusOr<CameraModel> ReadYamlCamera(const YAML::Node& node, const std::string& name, size_t index,
                                           std::vector<std::string>& remarks) {
  if (!node.IsMap()) return absl::InvalidArgumentError("is no map of fields");
  for (const char* stereo : {"M1", "D1", "P1"}) {
    if (YamlField(node, {stereo}).IsNull()) continue;
    return absl::InvalidArgumentError(absl::StrCat(
        "the field ", stereo, " is that of OpenCV's stereo_calib, which has two cameras and no size of ",
        "the images; write camera_matrix, distortion_coefficients, image_width, image_height, R and T ",
        "of each in a sequence `cameras`"));
  }
  CameraModel camera;
  const YAML::Node given =
      YamlField(node, {"camera_name", "name", "cam_name", "camera_id", "cam_id", "id", "label", "serial"});
  camera.id = given.IsScalar() && !given.Scalar().empty() ? given.Scalar() : name;
  if (camera.id.empty()) camera.id = absl::StrCat("camera", index);
  absl::Status status = SetSize(node, camera);
  if (status.ok()) status = SetMatrix(node, camera);
  if (status.ok()) status = SetYamlDistortion(node, camera, remarks);
  if (status.ok()) status = SetYamlPose(node, camera, remarks);
  if (!status.ok()) return status;
  return camera;
}

// A camera's fields, and its name where it is a key of a map.
struct NamedNode {
  std::string name;
  YAML::Node node;
};

// The file is one camera; a sequence `cameras` or the file itself are several, and so are maps of names.
absl::StatusOr<std::vector<NamedNode>> CamerasOf(const YAML::Node& root) {
  const YAML::Node cameras = root.IsMap() ? YamlField(root, {"cameras"}) : root;
  std::vector<NamedNode> out;
  if (cameras.IsSequence()) {
    for (const auto& node : cameras) out.push_back({"", node});
    if (out.empty()) return absl::InvalidArgumentError("has no camera in its list of cameras");
    return out;
  }
  if (!root.IsMap())
    return absl::InvalidArgumentError("has no fields at the top, so it is no file of a camera");
  const YAML::Node& of_names = cameras.IsMap() ? cameras : root;
  for (const auto& entry : of_names) {
    if (!entry.first.IsScalar() || !entry.second.IsMap()) continue;
    if (!YamlField(entry.second, {"camera_matrix", "K"}).IsNull())
      out.push_back({entry.first.Scalar(), entry.second});
  }
  if (out.empty()) out.push_back({"", root});
  return out;
}

absl::StatusOr<ForeignRig> ReadCameras(const YAML::Node& root) {
  if (root.IsMap() && IsKalibr(root)) return ReadKalibr(root);
  WEFT_ASSIGN_OR_RETURN(const std::vector<NamedNode> cameras, CamerasOf(root));
  ForeignRig out;
  for (size_t i = 0; i < cameras.size(); ++i) {
    const auto& [name, node] = cameras[i];
    absl::StatusOr<CameraModel> camera = ReadYamlCamera(node, name, i, out.remarks);
    if (!camera.ok())
      return absl::InvalidArgumentError(absl::StrCat("camera ", i, ": ", camera.status().message()));
    if (cameras.size() > 1 && camera->id == absl::StrCat("camera", i) && name != camera->id)
      out.remarks.push_back(absl::StrCat("camera ", i, " has no camera_name and is called ", camera->id));
    out.rig.cameras.push_back(*std::move(camera));
  }
  return out;
}

// That have content, by their "---": YAML::LoadAll of damaged files never ends (fuzz_rig).
int CountDocuments(absl::string_view text) {
  int documents = 0;
  bool has_content = false;
  for (const absl::string_view line : absl::StrSplit(text, '\n')) {
    const bool begins = absl::StartsWith(line, "---");
    if (begins) has_content = false;
    const absl::string_view content = absl::StripAsciiWhitespace(begins ? line.substr(3) : line);
    const bool is_empty = content.empty() || absl::StartsWith(content, "#") ||
                          absl::StartsWith(content, "%") || content == "...";
    if (!is_empty && !has_content) has_content = true, ++documents;
  }
  return documents;
}

absl::StatusOr<ForeignRig> ParseCameras(const std::string& text) {
  if (absl::StartsWith(absl::StripLeadingAsciiWhitespace(text), "<")) {
    // cv::FileStorage of OpenCV 4.6 reads beyond the memory of damaged XML (fuzz_rig).
    return absl::InvalidArgumentError(
        "is XML; write it as YAML: cv::FileStorage does so where the name of the file ends in .yml");
  }
  try {
    if (const int documents = CountDocuments(text); documents > 1)
      return absl::InvalidArgumentError(
          absl::StrCat("holds ", documents, " YAML documents; write one file for each camera"));
    return ReadCameras(YAML::Load(text));
  } catch (const YAML::Exception& error) {
    return absl::InvalidArgumentError(
        absl::StrCat("line ", error.mark.line + 1, ": is neither YAML nor JSON: ", error.msg));
  }
}

}  // namespace

absl::StatusOr<ForeignRig> ParseOpenCvYaml(std::string_view text, const std::string& source_name) {
  absl::StatusOr<ForeignRig> rig = ParseCameras(std::string(text));
  const absl::Status status = rig.ok() ? rig->Validate() : rig.status();
  if (!status.ok()) return absl::InvalidArgumentError(absl::StrCat(source_name, ": ", status.message()));
  return rig;
}

absl::StatusOr<std::string> FormatOpenCvYaml(const Rig& rig) {
  WEFT_RETURN_IF_ERROR(rig.Validate());
  cv::FileStorage file(".yml",
                       cv::FileStorage::WRITE | cv::FileStorage::MEMORY | cv::FileStorage::FORMAT_YAML);
  file << "cameras"
       << "[";
  for (const CameraModel& camera : rig.cameras) {
    int terms = 8;
    while (terms > 5 && camera.distortion[terms - 1] == 0) --terms;
    if (terms > 5) terms = 8;  // OpenCV knows 5 or 8
    cv::Mat distortion(1, terms, CV_64F), rotation(3, 3, CV_64F), translation(3, 1, CV_64F);
    for (int i = 0; i < terms; ++i) distortion.at<double>(i) = camera.distortion[i];
    for (int i = 0; i < 9; ++i) rotation.at<double>(i / 3, i % 3) = camera.rotation(i / 3, i % 3);
    for (int i = 0; i < 3; ++i) translation.at<double>(i) = camera.translation_mm[i];
    const cv::Mat k =
        (cv::Mat_<double>(3, 3) << camera.fx_px, 0, camera.cx_px, 0, camera.fy_px, camera.cy_px, 0, 0, 1);
    file << "{"
         << "camera_name" << camera.id << "image_width" << camera.width_px << "image_height"
         << camera.height_px << "camera_matrix" << k << "distortion_coefficients" << distortion << "R"
         << rotation << "T" << translation << "}";
  }
  file << "]";
  return file.releaseAndGetString();
}

}  // namespace weft
