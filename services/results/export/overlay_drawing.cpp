#include "services/results/export/overlay_drawing.h"

#include <array>
#include <cmath>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "evaluation/vertex_views.h"

namespace weft {
namespace {

constexpr std::array<std::pair<OverlayKind, const char*>, 4> kOverlays = {
    {{OverlayKind::kWireframe, "wireframe"},
     {OverlayKind::kState, "state"},
     {OverlayKind::kSigma, "sigma"},
     {OverlayKind::kNone, "none"}}};
constexpr double kOpacity = 0.55;
constexpr int kShift = 4;  // OpenCV draws at sixteenths of a pixel
// Distances do not matter: no cell is too small.
const ViewingOptions kAnySize{.max_facing_deg = 89, .min_pitch_px = 0, .clearance_mm = 2};

cv::Point FixedPoint(const Eigen::Vector2d& pixel_px) {
  constexpr int kOne = 1 << kShift;
  return {static_cast<int>(std::lround(kOne * pixel_px.x())),
          static_cast<int>(std::lround(kOne * pixel_px.y()))};
}

cv::Scalar Bytes(const Eigen::Vector3f& color) { return {255 * color.x(), 255 * color.y(), 255 * color.z()}; }

// Pixels of the vertices that the camera sees.
std::vector<std::optional<cv::Point>> SeenPixels(const VisibleMesh& mesh, const CameraModel& camera) {
  const std::vector<VertexView> views = mesh.Observe(camera, kAnySize);
  std::vector<std::optional<cv::Point>> pixels(views.size());
  for (size_t v = 0; v < views.size(); ++v) {
    if (!views[v].seen) continue;
    if (const auto pixel_px = camera.Project(mesh.vertices_mm()[v])) pixels[v] = FixedPoint(*pixel_px);
  }
  return pixels;
}

void DrawEdges(const OverlayMesh& mesh, const std::vector<std::optional<cv::Point>>& pixels, cv::Mat& image) {
  for (const Face& face : mesh.faces) {
    for (size_t k = 0; k < face.size(); ++k) {
      const int a = face[k], b = face[(k + 1) % face.size()];
      if (pixels[a] && pixels[b])
        cv::line(image, *pixels[a], *pixels[b], Bytes(mesh.colors[a]), 1, cv::LINE_AA, kShift);
    }
  }
}

void FillFaces(const OverlayMesh& mesh, const std::vector<std::optional<cv::Point>>& pixels, cv::Mat& image) {
  cv::Mat painted = image.clone();
  for (const Face& face : mesh.faces) {
    const auto [a, b, c] = face;
    if (!pixels[a] || !pixels[b] || !pixels[c]) continue;
    const std::array<cv::Point, 3> corners = {*pixels[a], *pixels[b], *pixels[c]};
    const Eigen::Vector3f color = (mesh.colors[a] + mesh.colors[b] + mesh.colors[c]) / 3;
    cv::fillConvexPoly(painted, corners.data(), static_cast<int>(corners.size()), Bytes(color), cv::LINE_8,
                       kShift);
  }
  cv::addWeighted(painted, kOpacity, image, 1 - kOpacity, 0, image);
}

}  // namespace

absl::StatusOr<OverlayKind> OverlayKindFromName(std::string_view name) {
  for (const auto& [kind, known] : kOverlays)
    if (name == known) return kind;
  return absl::InvalidArgumentError(
      absl::StrCat("--overlay: \"", std::string(name), "\" is not one of wireframe, state, sigma, none"));
}

const char* NameOf(OverlayKind kind) {
  for (const auto& [known, name] : kOverlays)
    if (known == kind) return name;
  return "";
}

absl::StatusOr<Frame> DrawOverlay(const Frame& picture, const OverlayMesh& mesh, const CameraModel& camera,
                                  OverlayKind kind) {
  const absl::StatusOr<Frame> rgb = ToRgb(picture);
  if (!rgb.ok() || kind == OverlayKind::kNone) return rgb;
  if (mesh.colors.size() != mesh.vertices_mm.size()) {
    return absl::InvalidArgumentError(absl::StrCat("colors: there are ", mesh.colors.size(), " for ",
                                                   mesh.vertices_mm.size(), " vertices"));
  }
  WEFT_ASSIGN_OR_RETURN(const VisibleMesh visible, VisibleMesh::Build(mesh.vertices_mm, mesh.faces, 1));
  const auto pixels = SeenPixels(visible, camera);
  auto bytes = std::make_shared<std::vector<uint8_t>>(*rgb->pixels);
  cv::Mat image(rgb->height_px, rgb->width_px, CV_8UC3, bytes->data());
  if (kind == OverlayKind::kWireframe) {
    DrawEdges(mesh, pixels, image);
  } else {
    FillFaces(mesh, pixels, image);
  }
  Frame drawn = *rgb;
  drawn.pixels = std::move(bytes);
  return drawn;
}

}  // namespace weft
