#include "services/results/export/undistorted_picture.h"

#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"

namespace weft {
namespace {

// Where in the picture each pixel of the other camera is; far outside where the lens saw nothing.
cv::Mat PlacesInPicture(const CameraModel& camera) {
  constexpr float kNowhere = -1e4f;
  CameraModel lens = camera;  // its own place does not matter
  lens.rotation.setIdentity();
  lens.translation_mm.setZero();
  cv::Mat places(camera.height_px, camera.width_px, CV_32FC2);
  for (int y = 0; y < camera.height_px; ++y) {
    for (int x = 0; x < camera.width_px; ++x) {
      const Eigen::Vector3d ray((x - camera.cx_px) / camera.fx_px, (y - camera.cy_px) / camera.fx_px, 1);
      const std::optional<Eigen::Vector2d> at = lens.Project(ray);
      places.at<cv::Vec2f>(y, x) = at ? cv::Vec2f(static_cast<float>(at->x()), static_cast<float>(at->y()))
                                      : cv::Vec2f(kNowhere, kNowhere);
    }
  }
  return places;
}

}  // namespace

CameraModel WithoutDistortion(const CameraModel& camera) {
  CameraModel pinhole = camera;
  pinhole.distortion.fill(0);
  pinhole.fy_px = camera.fx_px;
  return pinhole;
}

Rig WithoutDistortion(const Rig& rig) {
  Rig pinholes = rig;
  for (CameraModel& camera : pinholes.cameras) camera = WithoutDistortion(camera);
  return pinholes;
}

absl::StatusOr<Frame> UndistortPicture(const Frame& rgb, const CameraModel& camera) {
  WEFT_RETURN_IF_ERROR(camera.Validate());
  const size_t bytes = 3 * static_cast<size_t>(camera.width_px) * static_cast<size_t>(camera.height_px);
  if (rgb.width_px != camera.width_px || rgb.height_px != camera.height_px || rgb.pixels == nullptr ||
      rgb.pixels->size() != bytes) {
    return absl::InvalidArgumentError(absl::StrCat("camera ", camera.id, ": is ", camera.width_px, "x",
                                                   camera.height_px, " px, its picture ", rgb.width_px, "x",
                                                   rgb.height_px));
  }
  // OpenCV does not write to it.
  const cv::Mat picture(rgb.height_px, rgb.width_px, CV_8UC3, const_cast<uint8_t*>(rgb.pixels->data()));
  auto out = std::make_shared<std::vector<uint8_t>>(bytes);
  cv::Mat straight(rgb.height_px, rgb.width_px, CV_8UC3, out->data());
  cv::remap(picture, straight, PlacesInPicture(camera), cv::noArray(), cv::INTER_LINEAR, cv::BORDER_CONSTANT);
  Frame undistorted = rgb;
  undistorted.pixels = std::move(out);
  return undistorted;
}

}  // namespace weft
