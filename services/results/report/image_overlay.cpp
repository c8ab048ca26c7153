#include "services/results/report/image_overlay.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/image/image_encoders.h"
#include "capture/image/thumbnail.h"
#include "services/results/report/mesh_canvas.h"
#include "services/results/report/mesh_colors.h"

namespace weft {
namespace {

// Pixels of the image that are shown, half open.
struct PixelBox {
  int left = 0, top = 0, right = 0, bottom = 0;
  int width() const { return right - left; }
  int height() const { return bottom - top; }
};

struct ProjectedVertex {
  Eigen::Vector2d pixel_px;
  double depth_mm = 0;
};

std::vector<std::optional<ProjectedVertex>> ProjectAll(const CameraModel& camera,
                                                       const std::vector<Eigen::Vector3d>& vertices_mm) {
  std::vector<std::optional<ProjectedVertex>> out;
  out.reserve(vertices_mm.size());
  for (const Eigen::Vector3d& vertex : vertices_mm) {
    const std::optional<Eigen::Vector2d> pixel = camera.Project(vertex);
    const double depth_mm = (camera.rotation * vertex + camera.translation_mm).z();
    out.push_back(pixel ? std::optional(ProjectedVertex{*pixel, depth_mm}) : std::nullopt);
  }
  return out;
}

absl::StatusOr<PixelBox> BoxOf(const std::vector<std::optional<ProjectedVertex>>& vertices,
                               const CameraModel& camera, double margin_share) {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(1e9), high = -low;
  for (const auto& vertex : vertices) {
    if (!vertex || !camera.Contains(vertex->pixel_px)) continue;
    low = low.cwiseMin(vertex->pixel_px), high = high.cwiseMax(vertex->pixel_px);
  }
  if (!(low.x() <= high.x()))
    return absl::InvalidArgumentError(
        absl::StrCat("camera ", camera.id, " has nothing of the mesh in its image"));
  const double margin = margin_share * (high - low).maxCoeff();
  const auto at_least = [](double v) { return std::max(0, static_cast<int>(std::floor(v))); };
  return PixelBox{at_least(low.x() - margin), at_least(low.y() - margin),
                  std::min(camera.width_px, static_cast<int>(std::ceil(high.x() + margin)) + 1),
                  std::min(camera.height_px, static_cast<int>(std::ceil(high.y() + margin)) + 1)};
}

Frame Cropped(const Frame& rgb, const PixelBox& box) {
  auto pixels = std::make_shared<std::vector<uint8_t>>(static_cast<size_t>(box.width()) * box.height() * 3);
  for (int y = 0; y < box.height(); ++y)
    std::memcpy(pixels->data() + static_cast<size_t>(y) * box.width() * 3,
                rgb.row(box.top + y) + static_cast<size_t>(box.left) * 3,
                static_cast<size_t>(box.width()) * 3);
  Frame out = rgb;
  out.width_px = box.width(), out.height_px = box.height();
  out.pixels = std::move(pixels);
  return out;
}

// Colours are sRGB as they stand: the canvas only interpolates them. Depth is 1000 by the distance, which is
// linear in the image.
MeshCanvas DrawMesh(const std::vector<std::optional<ProjectedVertex>>& vertices, const RegisteredMesh& mesh,
                    const std::vector<Face>& faces, const PixelBox& box, int width_px, int height_px) {
  const double scale_x = static_cast<double>(width_px) / box.width(),
               scale_y = static_cast<double>(height_px) / box.height();
  std::vector<ScreenVertex> screen(vertices.size());
  for (size_t v = 0; v < vertices.size(); ++v) {
    if (!vertices[v]) continue;
    const Eigen::Vector3f color = StateColor(mesh.state[v]);
    screen[v] = {(vertices[v]->pixel_px.x() + 0.5 - box.left) * scale_x,
                 (vertices[v]->pixel_px.y() + 0.5 - box.top) * scale_y,
                 static_cast<float>(1000 / vertices[v]->depth_mm), color, color};
  }
  MeshCanvas canvas(width_px, height_px);
  for (const Face& face : faces)
    if (vertices[face[0]] && vertices[face[1]] && vertices[face[2]])
      canvas.Draw(screen[face[0]], screen[face[1]], screen[face[2]]);
  return canvas;
}

// Whether the second sample is beyond an outline of what the first one shows.
bool IsBeyond(const MeshCanvas& canvas, int x, int y, int other_x, int other_y, double jump_mm) {
  if (!canvas.IsHit(x, y)) return false;
  if (!canvas.IsHit(other_x, other_y)) return true;
  return 1000 / canvas.Depth(other_x, other_y) - 1000 / canvas.Depth(x, y) > jump_mm;
}

void Paint(const MeshCanvas& canvas, double jump_mm, double tint, int width, int height,
           std::vector<uint8_t>& rgb) {
  const auto pixel = [&](int x, int y) { return rgb.data() + (static_cast<size_t>(y) * width + x) * 3; };
  const Eigen::Vector3f observed = StateColor(VertexState::kObserved);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      if (!canvas.IsHit(x, y)) continue;
      const Eigen::Vector3f& color = canvas.Color(x, y);
      // Between vertices of two states the colour is between theirs.
      const double share = std::min(1.0, 2.0 * (color - observed).norm()) * tint;
      for (int c = 0; c < 3; ++c)
        pixel(x, y)[c] = static_cast<uint8_t>(
            std::lround((1 - share) * pixel(x, y)[c] + share * 255 * std::clamp(color[c], 0.0f, 1.0f)));
    }
  for (int y = 1; y + 1 < height; ++y)
    for (int x = 1; x + 1 < width; ++x)
      for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
        if (!IsBeyond(canvas, x, y, x + dx, y + dy, jump_mm)) continue;
        std::fill_n(pixel(x, y), 3, uint8_t{0});
        std::fill_n(pixel(x + dx, y + dy), 3, uint8_t{255});
      }
}

}  // namespace

absl::StatusOr<MeshPicture> DrawOverlay(const Frame& image, const CameraModel& camera,
                                        const RegisteredMesh& mesh, const std::vector<Face>& faces,
                                        const OverlayOptions& options) {
  if (image.width_px != camera.width_px || image.height_px != camera.height_px ||
      mesh.state.size() != mesh.vertices_mm.size())
    return absl::InvalidArgumentError(
        absl::StrCat("camera ", camera.id, ": image, rig and mesh do not fit each other"));
  const std::vector<std::optional<ProjectedVertex>> vertices = ProjectAll(camera, mesh.vertices_mm);
  WEFT_ASSIGN_OR_RETURN(const PixelBox box, BoxOf(vertices, camera, options.margin_share));
  WEFT_ASSIGN_OR_RETURN(const Frame rgb, ToRgb(image));
  const double scale = std::min({1.0, static_cast<double>(options.width_px) / box.width(),
                                 static_cast<double>(options.height_px) / box.height()});
  const int width = std::max(1, static_cast<int>(std::lround(scale * box.width()))),
            height = std::max(1, static_cast<int>(std::lround(scale * box.height())));
  WEFT_ASSIGN_OR_RETURN(const Frame small, Resized(Cropped(rgb, box), width, height));
  std::vector<uint8_t> pixels = *small.pixels;
  double nearest_mm = 1e9;
  for (const auto& vertex : vertices)
    if (vertex) nearest_mm = std::min(nearest_mm, vertex->depth_mm);
  constexpr double kJumpPixels = 15;  // steeper than cloth that a camera still sees
  const double jump_mm = kJumpPixels * nearest_mm / (camera.fx_px * scale);
  Paint(DrawMesh(vertices, mesh, faces, box, width, height), jump_mm, options.tint, width, height, pixels);
  WEFT_ASSIGN_OR_RETURN(const std::vector<uint8_t> jpeg,
                        EncodeJpeg({width, height, 3, 8, pixels}, options.jpeg_quality));
  return MeshPicture{absl::StrCat("Camera ", camera.id), std::string(jpeg.begin(), jpeg.end()), width, height,
                     "image/jpeg"};
}

}  // namespace weft
