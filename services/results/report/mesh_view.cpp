#include "services/results/report/mesh_view.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/image/image_encoders.h"
#include "services/results/report/mesh_canvas.h"

namespace weft {
namespace {

constexpr int64_t kMaxSamples = 100'000'000;
constexpr float kInsideShare = 0.55f;  // brightness of the inside

float LinearFromSrgb(float c) { return c <= 0.04045f ? c / 12.92f : std::pow((c + 0.055f) / 1.055f, 2.4f); }

absl::Status CheckMesh(const TriangleMesh& mesh, size_t colors) {
  const size_t n = mesh.vertices_mm.size();
  if (mesh.faces.empty()) return absl::InvalidArgumentError("the mesh has no faces");
  if (colors != n) {
    return absl::InvalidArgumentError(absl::StrCat("colors: there are ", colors, " for ", n, " vertices"));
  }
  for (size_t i = 0; i < n; ++i) {
    if (!mesh.vertices_mm[i].allFinite()) {
      return absl::InvalidArgumentError(absl::StrCat("vertex ", i, ": its position is not finite"));
    }
  }
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    for (const int index : mesh.faces[f]) {
      if (index < 0 || static_cast<size_t>(index) >= n) {
        return absl::InvalidArgumentError(
            absl::StrCat("face ", f, ": names vertex ", index, ", the mesh has ", n, " vertices"));
      }
    }
  }
  return absl::OkStatus();
}

// Area-weighted, in the axes of the view.
std::vector<Eigen::Vector3d> NormalsOf(const std::vector<Face>& faces,
                                       const std::vector<Eigen::Vector3d>& seen_mm) {
  std::vector<Eigen::Vector3d> normals(seen_mm.size(), Eigen::Vector3d::Zero());
  for (const Face& face : faces) {
    const Eigen::Vector3d& a = seen_mm[face[0]];
    const Eigen::Vector3d area = (seen_mm[face[1]] - a).cross(seen_mm[face[2]] - a);
    for (const int v : face) normals[v] += area;
  }
  for (Eigen::Vector3d& normal : normals) {
    const double length = normal.norm();
    normal = length > 0 ? Eigen::Vector3d(normal / length) : Eigen::Vector3d::UnitZ();
  }
  return normals;
}

// Light that a surface sends to the viewer, about 1 where it faces the key light.
float LightOn(const Eigen::Vector3d& normal) {
  static const Eigen::Vector3d kKey = Eigen::Vector3d(-0.55, 0.60, 0.58).normalized();
  const double key = std::max(0.0, (normal.dot(kKey) + 0.15) / 1.15);
  const double sky = 0.5 + 0.5 * normal.y();
  return static_cast<float>(0.16 + 0.14 * sky + 0.12 * std::max(0.0, normal.z()) + 0.72 * key);
}

// Samples per mm and the position of the view's origin.
struct Framing {
  double samples_per_mm = 0;
  double x0 = 0, y0 = 0;
};

absl::StatusOr<Framing> FrameMesh(const std::vector<Eigen::Vector3d>& seen_mm,
                                  const MeshViewOptions& options) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p : seen_mm) box.extend(p);
  const double wide = box.sizes().x(), tall = box.sizes().y();
  if (!(std::max(wide, tall) > 1e-9) || !std::isfinite(wide) || !std::isfinite(tall)) {
    return absl::InvalidArgumentError("the mesh has no extent that could be framed");
  }
  const int ss = options.supersampling;
  const double room_x = (options.width_px - 2 * options.margin_px) * ss;
  const double room_y = (options.height_px - 2 * options.margin_px) * ss;
  Framing framing;
  framing.samples_per_mm = std::min(room_x / std::max(wide, 1e-9), room_y / std::max(tall, 1e-9));
  framing.x0 = 0.5 * options.width_px * ss - framing.samples_per_mm * box.center().x();
  framing.y0 = 0.5 * options.height_px * ss + framing.samples_per_mm * box.center().y();
  return framing;
}

std::vector<ScreenVertex> Project(const std::vector<Eigen::Vector3d>& seen_mm, const std::vector<Face>& faces,
                                  const std::vector<Eigen::Vector3f>& colors, const Framing& framing,
                                  double shading) {
  const std::vector<Eigen::Vector3d> normals = NormalsOf(faces, seen_mm);
  const auto strength = static_cast<float>(shading);
  std::vector<ScreenVertex> screen(seen_mm.size());
  for (size_t i = 0; i < seen_mm.size(); ++i) {
    ScreenVertex& v = screen[i];
    v.x = framing.x0 + framing.samples_per_mm * seen_mm[i].x();
    v.y = framing.y0 - framing.samples_per_mm * seen_mm[i].y();
    v.depth = static_cast<float>(seen_mm[i].z());
    const Eigen::Vector3f color = colors[i].cwiseMax(0.0f).cwiseMin(1.0f).unaryExpr(&LinearFromSrgb);
    v.outside = color * (1 - strength + strength * LightOn(normals[i]));
    v.inside = color * (1 - strength + strength * LightOn(-normals[i])) * kInsideShare;
  }
  return screen;
}

}  // namespace

absl::Status MeshViewOptions::Validate() const {
  if (width_px < 1 || height_px < 1) {
    return absl::InvalidArgumentError(
        absl::StrCat("width_px and height_px: are ", width_px, " x ", height_px, ", must be positive"));
  }
  if (supersampling < 1 || supersampling > 16) {
    return absl::InvalidArgumentError(absl::StrCat("supersampling: is ", supersampling, ", must be 1 to 16"));
  }
  if (int64_t{width_px} * height_px > kMaxSamples / (supersampling * supersampling)) {
    return absl::InvalidArgumentError(
        absl::StrCat("width_px, height_px, supersampling: more than ", kMaxSamples, " samples; lower one"));
  }
  if (margin_px < 0 || 2 * margin_px >= std::min(width_px, height_px)) {
    return absl::InvalidArgumentError(absl::StrCat("margin_px: is ", margin_px, ", leaves no picture"));
  }
  if (!(shading >= 0 && shading <= 1)) {
    return absl::InvalidArgumentError(absl::StrCat("shading: is ", shading, ", must be 0 to 1"));
  }
  return absl::OkStatus();
}

absl::StatusOr<MeshView> RenderMesh(const TriangleMesh& mesh, const std::vector<Eigen::Vector3f>& colors,
                                    const Viewpoint& viewpoint, const MeshViewOptions& options) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  WEFT_RETURN_IF_ERROR(CheckMesh(mesh, colors.size()));
  std::vector<Eigen::Vector3d> seen_mm;
  seen_mm.reserve(mesh.vertices_mm.size());
  for (const Eigen::Vector3d& p : mesh.vertices_mm) {
    seen_mm.emplace_back(p.dot(viewpoint.right), p.dot(viewpoint.up), p.dot(viewpoint.towards_viewer));
  }
  WEFT_ASSIGN_OR_RETURN(const Framing framing, FrameMesh(seen_mm, options));
  const std::vector<ScreenVertex> screen = Project(seen_mm, mesh.faces, colors, framing, options.shading);
  const int ss = options.supersampling;
  MeshCanvas canvas(options.width_px * ss, options.height_px * ss);
  for (const Face& face : mesh.faces) canvas.Draw(screen[face[0]], screen[face[1]], screen[face[2]]);
  MeshView view = canvas.Resolve(ss, options.transparent);
  view.px_per_mm = framing.samples_per_mm / ss;
  return view;
}

absl::StatusOr<std::string> EncodePng(const MeshView& view) {
  WEFT_ASSIGN_OR_RETURN(const std::vector<uint8_t> png,
                        EncodePng({view.width_px, view.height_px, 4, 8, view.rgba}, PngEffort::kSmall));
  return std::string(png.begin(), png.end());
}

}  // namespace weft
