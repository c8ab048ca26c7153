#include "simulation/studio_scene.h"

#include <cmath>
#include <numbers>

#include "absl/strings/str_cat.h"
#include "simulation/random.h"

namespace weft {

absl::Status StudioOptions::Validate() const {
  if (absl::Status status = inks.Validate(); !status.ok()) return status;
  if (!(backdrop.variation >= 0 && backdrop.variation <= 1))
    return absl::InvalidArgumentError("backdrop: variation must lie between 0 and 1");
  return light.Validate();
}

absl::StatusOr<StudioScene> StudioScene::Build(TriangleMesh mesh, ClothPrint print, Board board,
                                               const StudioOptions& options) {
  if (absl::Status status = options.Validate(); !status.ok()) return status;
  if (absl::Status status = board.Validate(); !status.ok()) return status;
  if (print.of_face.size() != mesh.faces.size()) {
    return absl::InvalidArgumentError(
        absl::StrCat("print has ", print.of_face.size(), " faces, the mesh ", mesh.faces.size()));
  }
  absl::StatusOr<RayScene> rays = RayScene::Build(mesh.vertices_mm, mesh.faces);
  if (!rays.ok()) return rays.status();
  StudioScene out;
  out.rays_ = *std::move(rays);
  out.light_ =
      LightVertices(out.rays_, mesh.vertices_mm, VertexNormals(mesh.vertices_mm, mesh.faces), options.light);
  out.mesh_ = std::move(mesh);
  out.print_ = std::move(print);
  out.board_ = std::move(board);
  out.options_ = options;
  out.HangBackdrop();
  return out;
}

Eigen::Vector3f StudioScene::Radiance(const RayHit& hit, const Eigen::Vector3f& direction) const {
  if (hit.face < 0) return Backdrop(direction);
  const Face& face = mesh_.faces[hit.face];
  const float b = hit.weight_b, c = hit.weight_c, a = 1 - b - c;
  const std::vector<float>& side = hit.from_outside ? light_.outside : light_.inside;
  const float light = a * side[face[0]] + b * side[face[1]] + c * side[face[2]];
  if (!hit.from_outside) return options_.inks.back * light;
  const auto& corners = print_.of_face[hit.face];
  if (std::isnan(corners[0].x())) return options_.inks.line * light;
  const BoardPoint p = a * corners[0] + b * corners[1] + c * corners[2];
  return InkAt(board_, options_.inks, static_cast<float>(p.x()), static_cast<float>(p.y())) * light;
}

void StudioScene::HangBackdrop() {
  const uint64_t key = KeyOf(options_.backdrop.seed, "backdrop");
  for (uint64_t k = 0; k < waves_.size(); ++k) {
    waves_[k].around = static_cast<float>(std::round(3 + 14 * UniformOf(key, 3 * k)));
    waves_[k].drift = static_cast<float>(8 * UniformOf(key, 3 * k + 1) - 4);
    waves_[k].phase = static_cast<float>(2 * std::numbers::pi * UniformOf(key, 3 * k + 2));
  }
}

Eigen::Vector3f StudioScene::Backdrop(const Eigen::Vector3f& direction) const {
  const BackdropOptions& o = options_.backdrop;
  const float length = direction.norm();
  if (!(length > 0)) return o.color;
  const float angle = std::atan2(direction.x(), direction.z()), height = direction.y() / length;
  float sum = 0;
  for (const Wave& w : waves_) sum += std::sin(w.around * angle + w.drift * height + w.phase);
  return o.color * (1 + o.variation * sum / static_cast<float>(waves_.size()));
}

}  // namespace weft
