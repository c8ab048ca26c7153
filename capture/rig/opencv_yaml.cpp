#include "capture/rig/opencv_yaml.h"

#include <yaml-cpp/yaml.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <opencv2/core.hpp>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/str_split.h"
#include "capture/rig/lens_fit.h"

namespace weft {
namespace {

// More than any field of a camera has. Aliases of YAML can make a short text as large as they like.
constexpr size_t kMostNumbers = 64;
constexpr int kMostNesting = 8;

// OpenCV 2 wrote Camera_Matrix, ROS 2 prints k: case and underscores are no difference.
std::string Key(absl::string_view name) {
  return absl::StrReplaceAll(absl::AsciiStrToLower(name), {{"_", ""}});
}

// Null where there is no such field.
YAML::Node Field(const YAML::Node& map, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    for (const auto& entry : map) {
      if (entry.first.IsScalar() && Key(entry.first.Scalar()) == Key(name)) return entry.second;
    }
  }
  return YAML::Node(YAML::NodeType::Null);
}

absl::Status Flatten(const YAML::Node& node, int nesting, std::vector<double>& out) {
  if (nesting > kMostNesting || out.size() > kMostNumbers)
    return absl::InvalidArgumentError("has more numbers than a camera");
  if (node.IsSequence()) {
    for (const auto& item : node) {
      if (absl::Status status = Flatten(item, nesting + 1, out); !status.ok()) return status;
    }
    return absl::OkStatus();
  }
  double value = 0;
  if (!node.IsScalar() || !absl::SimpleAtod(node.Scalar(), &value) || !std::isfinite(value)) {
    return absl::InvalidArgumentError(
        absl::StrCat(node.IsScalar() ? absl::StrCat("\"", node.Scalar().substr(0, 40), "\"") : "an entry",
                     " is no number"));
  }
  out.push_back(value);
  return absl::OkStatus();
}

// The numbers of a sequence, or of the field `data` of a matrix; empty where the field is missing.
absl::StatusOr<std::vector<double>> NumbersOf(const YAML::Node& node, const char* name) {
  std::vector<double> numbers;
  if (node.IsNull()) return numbers;
  const YAML::Node data = node.IsMap() ? Field(node, {"data"}) : node;
  absl::Status status = data.IsSequence()
                            ? Flatten(data, 0, numbers)
                            : absl::InvalidArgumentError("is neither a matrix nor a list of numbers");
  if (status.ok() && node.IsMap()) {
    std::vector<double> size;
    for (const char* field : {"rows", "cols"}) status.Update(Flatten(Field(node, {field}), 0, size));
    if (status.ok() && size[0] * size[1] != static_cast<double>(numbers.size())) {
      status = absl::InvalidArgumentError(
          absl::StrCat("has ", numbers.size(), " numbers, its rows and cols make ", size[0] * size[1]));
    }
  }
  if (!status.ok())
    return absl::InvalidArgumentError(absl::StrCat("the field ", name, " ", status.message()));
  return numbers;
}

absl::StatusOr<std::vector<double>> NumbersOf(const YAML::Node& node, const char* name, size_t count) {
  absl::StatusOr<std::vector<double>> numbers = NumbersOf(node, name);
  if (!numbers.ok() || numbers->size() == count) return numbers;
  if (node.IsNull()) return absl::InvalidArgumentError(absl::StrCat("the field ", name, " is missing"));
  return absl::InvalidArgumentError(
      absl::StrCat("the field ", name, " has ", numbers->size(), " numbers, expected ", count));
}

absl::Status SetSize(const YAML::Node& node, CameraModel& camera) {
  const std::pair<const char*, int*> fields[] = {{"width", &camera.width_px}, {"height", &camera.height_px}};
  for (const auto& [name, value] : fields) {
    const YAML::Node field = Field(node, {absl::StrCat("image_", name).c_str(), name});
    if (!field.IsScalar() || !absl::SimpleAtoi(field.Scalar(), value)) {
      return absl::InvalidArgumentError(absl::StrCat("the field image_", name, " is missing or no integer"));
    }
  }
  return absl::OkStatus();
}

absl::Status SetMatrix(const YAML::Node& node, CameraModel& camera) {
  const auto k = NumbersOf(Field(node, {"camera_matrix", "K"}), "camera_matrix", 9);
  if (!k.ok()) return k.status();
  if ((*k)[1] != 0 || (*k)[3] != 0 || (*k)[6] != 0 || (*k)[7] != 0 || (*k)[8] != 1) {
    return absl::InvalidArgumentError(
        "camera_matrix has skew or is not normalised; expected fx 0 cx / 0 fy cy / 0 0 1");
  }
  camera.fx_px = (*k)[0], camera.cx_px = (*k)[2], camera.fy_px = (*k)[4], camera.cy_px = (*k)[5];
  return absl::OkStatus();
}

// Adds a remark where the lens was fitted.
absl::Status SetFitted(const RadiusOfAngle& radius, CameraModel& camera, std::vector<std::string>& remarks) {
  const absl::StatusOr<double> error_px = FitLens(radius, &camera);
  if (!error_px.ok())
    return absl::InvalidArgumentError(absl::StrCat("its fisheye lens: ", error_px.status().message()));
  remarks.push_back(absl::StrFormat("camera %s: its fisheye lens is held to %.2g px by Weft's rational lens",
                                    camera.id, *error_px));
  return absl::OkStatus();
}

// A lens by the name that ROS or Kalibr gives its model; fx, fy, cx, cy and the size of the image are set.
absl::Status SetLens(const std::string& model, const std::vector<double>& k, CameraModel& camera,
                     std::vector<std::string>& remarks) {
  const std::string name = Key(model);
  const auto count = [&](size_t wanted) {
    return k.size() == wanted
               ? absl::OkStatus()
               : absl::InvalidArgumentError(absl::StrCat("the model ", model, " has ", wanted,
                                                         " distortion coefficients, the file ", k.size()));
  };
  if (name == "none") return count(0);
  if (name == "equidistant" || name == "equi" || name == "fisheye" || name == "kannalabrandt4") {
    const absl::Status status = count(4);
    return status.ok() ? SetFitted(FisheyeRadius(k), camera, remarks) : status;
  }
  if (name == "fov") {
    const absl::Status status = count(1);
    return status.ok() ? SetFitted(FovRadius(k[0]), camera, remarks) : status;
  }
  if (name.empty() || name == "plumbbob" || name == "radtan" || name == "rationalpolynomial" ||
      name == "thinprism" || name == "opencv" || name == "pinhole") {
    return SetOpenCvDistortion(k, &camera);
  }
  return absl::InvalidArgumentError(absl::StrCat(
      "the lens model ", model, " has no counterpart here; known are plumb_bob, radtan, ",
      "rational_polynomial, equidistant, fisheye and fov. Undistort the pictures, or calibrate with one ",
      "of these"));
}

bool IsTrue(const YAML::Node& node) {
  return node.IsScalar() && node.Scalar() != "0" && !absl::EqualsIgnoreCase(node.Scalar(), "false");
}

absl::Status SetDistortion(const YAML::Node& node, CameraModel& camera, std::vector<std::string>& remarks) {
  if (!Field(node, {"xi"}).IsNull()) {
    return absl::InvalidArgumentError(
        "the field xi is that of an omnidirectional lens, which has no counterpart here; undistort the "
        "pictures");
  }
  const YAML::Node field = Field(node, {"distortion_coefficients", "dist_coeffs", "D"});
  if (field.IsNull()) return absl::InvalidArgumentError("the field distortion_coefficients is missing");
  const auto k = NumbersOf(field, "distortion_coefficients");
  if (!k.ok()) return k.status();
  const YAML::Node named = Field(node, {"distortion_model"}), fisheye = Field(node, {"fisheye_model"});
  std::string model = named.IsScalar() ? named.Scalar() : "";
  if (model.empty() && IsTrue(fisheye)) model = "fisheye";
  if (k->size() == 4 && model.empty() && fisheye.IsNull()) {
    remarks.push_back(
        absl::StrCat("camera ", camera.id,
                     ": its four distortion coefficients are taken as k1 k2 p1 p2; if they are those ",
                     "of a fisheye lens, add the line `distortion_model: fisheye` to its file"));
  }
  return SetLens(model, *k, camera, remarks);
}

absl::Status SetPose(const YAML::Node& node, CameraModel& camera) {
  const YAML::Node r = Field(node, {"R"}), t = Field(node, {"T"});
  // ROS: R turns to the rectified image, and no pose is told.
  const bool is_ros = !Field(node, {"P"}).IsNull() && t.IsNull();
  if (is_ros || (r.IsNull() && t.IsNull())) return absl::OkStatus();
  const auto turn = NumbersOf(r, "R"), shift = NumbersOf(t, "T", 3);
  if (!turn.ok()) return turn.status();
  if (!shift.ok()) return shift.status();
  if (turn->size() == 3) {  // cv::Rodrigues
    const Eigen::Vector3d rodrigues(turn->data());
    if (rodrigues.norm() > 0)
      camera.rotation = Eigen::AngleAxisd(rodrigues.norm(), rodrigues.normalized()).toRotationMatrix();
  } else if (const auto nine = NumbersOf(r, "R", 9); !nine.ok()) {
    return nine.status();
  } else {
    for (int i = 0; i < 9; ++i) camera.rotation(i / 3, i % 3) = (*nine)[i];
  }
  for (int i = 0; i < 3; ++i) camera.translation_mm[i] = (*shift)[i];
  return absl::OkStatus();
}

absl::StatusOr<CameraModel> ReadYamlCamera(const YAML::Node& node, size_t index,
                                           std::vector<std::string>& remarks) {
  if (!node.IsMap()) return absl::InvalidArgumentError("is no map of fields");
  for (const char* stereo : {"M1", "D1", "P1"}) {
    if (Field(node, {stereo}).IsNull()) continue;
    return absl::InvalidArgumentError(absl::StrCat(
        "the field ", stereo, " is that of OpenCV's stereo_calib, which has two cameras and no size of ",
        "the images; write camera_matrix, distortion_coefficients, image_width, image_height, R and T ",
        "of each in a sequence `cameras`"));
  }
  CameraModel camera;
  const YAML::Node name = Field(node, {"camera_name"});
  camera.id = name.IsScalar() && !name.Scalar().empty() ? name.Scalar() : absl::StrCat("camera", index);
  absl::Status status = SetSize(node, camera);
  if (status.ok()) status = SetMatrix(node, camera);
  if (status.ok()) status = SetDistortion(node, camera, remarks);
  if (status.ok()) status = SetPose(node, camera);
  if (!status.ok()) return status;
  return camera;
}

// Kalibr: `before` is the camera of which T_cn_cnm1 tells the pose.
absl::StatusOr<CameraModel> ReadKalibrCamera(const YAML::Node& node, const std::string& id,
                                             const CameraModel* before, std::vector<std::string>& remarks) {
  CameraModel camera;
  camera.id = id;
  const YAML::Node model = Field(node, {"camera_model"}), lens = Field(node, {"distortion_model"});
  if (model.IsScalar() && model.Scalar() != "pinhole") {
    return absl::InvalidArgumentError(absl::StrCat(
        "the camera model ", model.Scalar(), " has no counterpart here; calibrate with a pinhole model"));
  }
  const auto k = NumbersOf(Field(node, {"intrinsics"}), "intrinsics", 4);
  const auto size = NumbersOf(Field(node, {"resolution"}), "resolution", 2);
  const auto distortion = NumbersOf(Field(node, {"distortion_coeffs"}), "distortion_coeffs");
  for (const absl::Status& status : {k.status(), size.status(), distortion.status()})
    if (!status.ok()) return status;
  camera.fx_px = (*k)[0], camera.fy_px = (*k)[1], camera.cx_px = (*k)[2], camera.cy_px = (*k)[3];
  camera.width_px = static_cast<int>(std::clamp((*size)[0], 0.0, 1e6));
  camera.height_px = static_cast<int>(std::clamp((*size)[1], 0.0, 1e6));
  if (absl::Status status = SetLens(lens.IsScalar() ? lens.Scalar() : "", *distortion, camera, remarks);
      !status.ok())
    return status;
  if (before == nullptr) return camera;
  const auto step = NumbersOf(Field(node, {"T_cn_cnm1"}), "T_cn_cnm1", 16);
  if (!step.ok()) return step.status();
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> from_before(step->data());
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

absl::StatusOr<ForeignRig> ReadKalibr(const YAML::Node& root) {
  ForeignRig out;
  for (size_t i = 0;; ++i) {
    const std::string id = absl::StrCat("cam", i);
    const YAML::Node node = Field(root, {id.c_str()});
    if (node.IsNull()) {
      if (absl::Status status = CheckNoneFollows(root, i); !status.ok()) return status;
      return out;
    }
    const CameraModel* before = i == 0 ? nullptr : &out.rig.cameras.back();
    absl::StatusOr<CameraModel> camera = ReadKalibrCamera(node, id, before, out.remarks);
    if (!camera.ok()) return absl::InvalidArgumentError(absl::StrCat(id, ": ", camera.status().message()));
    out.rig.cameras.push_back(*std::move(camera));
  }
}

absl::StatusOr<ForeignRig> ReadCameras(const YAML::Node& root) {
  if (!root.IsMap())
    return absl::InvalidArgumentError("has no fields at the top, so it is no file of a camera");
  if (const YAML::Node first = Field(root, {"cam0"}); first.IsMap() && !Field(first, {"intrinsics"}).IsNull())
    return ReadKalibr(root);
  const YAML::Node cameras = Field(root, {"cameras"});
  ForeignRig out;
  for (size_t i = 0; i < (cameras.IsSequence() ? cameras.size() : 1); ++i) {
    absl::StatusOr<CameraModel> camera =
        ReadYamlCamera(cameras.IsSequence() ? cameras[i] : root, i, out.remarks);
    if (!camera.ok())
      return absl::InvalidArgumentError(absl::StrCat("camera ", i, ": ", camera.status().message()));
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
  if (absl::Status status = rig.Validate(); !status.ok()) return status;
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
