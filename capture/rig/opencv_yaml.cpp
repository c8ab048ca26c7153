#include "capture/rig/opencv_yaml.h"

#include <opencv2/core.hpp>
#include <vector>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

absl::StatusOr<std::vector<double>> Numbers(const cv::FileNode& camera, const char* field, size_t least,
                                            size_t most) {
  const cv::FileNode node = camera[field];
  if (node.empty()) return absl::InvalidArgumentError(absl::StrCat("the field ", field, " is missing"));
  cv::Mat matrix;
  node >> matrix;
  if (matrix.total() < least || matrix.total() > most || matrix.channels() != 1) {
    return absl::InvalidArgumentError(absl::StrCat("the field ", field, " has ", matrix.total(),
                                                   " numbers, expected ", least,
                                                   least == most ? "" : absl::StrCat(" to ", most)));
  }
  matrix.convertTo(matrix, CV_64F);
  return std::vector<double>(matrix.begin<double>(), matrix.end<double>());
}

absl::StatusOr<CameraModel> ReadYamlCamera(const cv::FileNode& node, int index) {
  CameraModel camera;
  camera.id = node["camera_name"].empty() ? absl::StrCat("camera", index) : std::string(node["camera_name"]);
  for (const char* field : {"image_width", "image_height"}) {
    if (!node[field].isInt())
      return absl::InvalidArgumentError(absl::StrCat("the field ", field, " is missing or no integer"));
  }
  camera.width_px = static_cast<int>(node["image_width"]);
  camera.height_px = static_cast<int>(node["image_height"]);
  const auto k = Numbers(node, "camera_matrix", 9, 9);
  if (!k.ok()) return k.status();
  if ((*k)[1] != 0 || (*k)[3] != 0 || (*k)[6] != 0 || (*k)[7] != 0 || (*k)[8] != 1) {
    return absl::InvalidArgumentError(
        "camera_matrix has skew or is not normalised; expected fx 0 cx / 0 fy cy / 0 0 1");
  }
  camera.fx_px = (*k)[0];
  camera.cx_px = (*k)[2];
  camera.fy_px = (*k)[4];
  camera.cy_px = (*k)[5];
  const auto distortion = Numbers(node, "distortion_coefficients", 4, 8);
  if (!distortion.ok()) return distortion.status();
  std::copy(distortion->begin(), distortion->end(), camera.distortion.begin());
  if (node["R"].empty() && node["T"].empty()) return camera;
  const auto r = Numbers(node, "R", 9, 9), t = Numbers(node, "T", 3, 3);
  if (!r.ok()) return r.status();
  if (!t.ok()) return t.status();
  for (int i = 0; i < 9; ++i) camera.rotation(i / 3, i % 3) = (*r)[i];
  for (int i = 0; i < 3; ++i) camera.translation_mm[i] = (*t)[i];
  return camera;
}

}  // namespace

absl::StatusOr<Rig> ParseOpenCvYaml(std::string_view text, const std::string& source_name) {
  Rig rig;
  try {
    const cv::FileStorage file(
        std::string(text), cv::FileStorage::READ | cv::FileStorage::MEMORY | cv::FileStorage::FORMAT_YAML);
    std::vector<cv::FileNode> nodes;
    if (file["cameras"].isSeq()) {
      for (const auto& node : file["cameras"]) nodes.push_back(node);
    } else {
      nodes.push_back(file.root());
    }
    for (size_t i = 0; i < nodes.size(); ++i) {
      absl::StatusOr<CameraModel> camera = ReadYamlCamera(nodes[i], static_cast<int>(i));
      if (!camera.ok()) {
        return absl::InvalidArgumentError(
            absl::StrCat(source_name, ": camera ", i, ": ", camera.status().message()));
      }
      rig.cameras.push_back(*std::move(camera));
    }
  } catch (const cv::Exception& error) {
    return absl::InvalidArgumentError(
        absl::StrCat(source_name, ": is no YAML that OpenCV reads: ", error.err));
  }
  if (absl::Status status = rig.Validate(); !status.ok()) {
    return absl::InvalidArgumentError(absl::StrCat(source_name, ": ", status.message()));
  }
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
