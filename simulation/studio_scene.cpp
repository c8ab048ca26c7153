#include "simulation/studio_scene.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "alignment/vertex_normals.h"
#include "base/status_macros.h"
#include "simulation/random.h"

namespace weft {
namespace {

absl::Status CheckParts(const MovingMesh& cloth, const ClothPrint& print, const MovingMesh& body) {
  if (print.of_face.size() != cloth.mesh.faces.size()) {
    return absl::InvalidArgumentError(
        absl::StrCat("print has ", print.of_face.size(), " faces, the mesh ", cloth.mesh.faces.size()));
  }
  for (const MovingMesh* part : {&cloth, &body}) {
    if (part->velocities_mm_s.empty() || part->velocities_mm_s.size() == part->mesh.vertices_mm.size())
      continue;
    return absl::InvalidArgumentError(absl::StrCat(part->velocities_mm_s.size(), " velocities for a mesh of ",
                                                   part->mesh.vertices_mm.size(), " vertices"));
  }
  return absl::OkStatus();
}

void Append(const MovingMesh& part, bool moving, std::vector<Face>* faces,
            std::vector<Eigen::Vector3d>* places_mm, std::vector<Eigen::Vector3d>* velocities_mm_s) {
  const auto first = static_cast<int>(places_mm->size());
  for (const Face& f : part.mesh.faces) faces->push_back({f[0] + first, f[1] + first, f[2] + first});
  places_mm->insert(places_mm->end(), part.mesh.vertices_mm.begin(), part.mesh.vertices_mm.end());
  if (!moving) return;
  velocities_mm_s->insert(velocities_mm_s->end(), part.velocities_mm_s.begin(), part.velocities_mm_s.end());
  velocities_mm_s->resize(places_mm->size(), Eigen::Vector3d::Zero());
}

}  // namespace

absl::Status StudioOptions::Validate() const {
  absl::Status status = inks.Validate();
  status.Update(fabric.Validate());
  status.Update(light.Validate());
  status.Update(room.Validate());
  if (!(skin.variation >= 0 && skin.variation < 1))
    status.Update(absl::InvalidArgumentError("skin: variation must lie between 0 and 1"));
  return status;
}

absl::StatusOr<StudioScene> StudioScene::Build(MovingMesh cloth, ClothPrint print, Board board,
                                               MovingMesh body, const StudioOptions& options) {
  absl::Status status = options.Validate();
  status.Update(board.Validate());
  status.Update(CheckParts(cloth, print, body));
  if (!status.ok()) return status;
  auto fixed = std::make_shared<Fixed>();
  fixed->options = options;
  fixed->print = std::move(print);
  fixed->ink = PrintedInk(board, options.inks);
  fixed->board = std::move(board);
  fixed->room = StudioRoom(options.room, options.light);
  fixed->cloth_vertices = cloth.mesh.vertices_mm.size();
  const bool moving = !cloth.velocities_mm_s.empty() || !body.velocities_mm_s.empty();
  Append(cloth, moving, &fixed->faces, &fixed->places_mm, &fixed->velocities_mm_s);
  Append(body, moving, &fixed->faces, &fixed->places_mm, &fixed->velocities_mm_s);
  WEFT_ASSIGN_OR_RETURN(RayScene rays, RayScene::Build(fixed->places_mm, fixed->faces));
  fixed->rays = std::move(rays);
  LightUp(*fixed);
  StudioScene out;
  out.fixed_ = std::move(fixed);
  return out.Exposed(0, 0);
}

absl::StatusOr<StudioScene> StudioScene::Exposed(double offset_s, double exposure_s) const {
  StudioScene out;
  out.fixed_ = fixed_;
  out.places_mm_ = fixed_->places_mm;
  const std::vector<Eigen::Vector3d>& velocities = fixed_->velocities_mm_s;
  for (size_t v = 0; v < velocities.size(); ++v) out.places_mm_[v] += offset_s * velocities[v];
  if (exposure_s > 0) {
    out.paths_mm_.reserve(velocities.size());
    for (const Eigen::Vector3d& velocity : velocities) out.paths_mm_.emplace_back(exposure_s * velocity);
  }
  out.mesh_.vertices_mm.assign(out.places_mm_.begin(),
                               out.places_mm_.begin() + static_cast<std::ptrdiff_t>(fixed_->cloth_vertices));
  out.mesh_.faces.assign(fixed_->faces.begin(),
                         fixed_->faces.begin() + static_cast<std::ptrdiff_t>(fixed_->print.of_face.size()));
  out.rays_ = fixed_->rays;
  if (offset_s == 0 || velocities.empty()) return out;
  WEFT_ASSIGN_OR_RETURN(RayScene rays, RayScene::Build(out.places_mm_, fixed_->faces));
  out.rays_ = std::move(rays);
  return out;
}

void StudioScene::LightUp(Fixed& fixed) {
  VertexLight light = LightVertices(fixed.rays, fixed.places_mm, VertexNormals(fixed.places_mm, fixed.faces),
                                    fixed.cloth_vertices, fixed.options.light);
  fixed.light_by_slope = LightBySlope(fixed, light);
  fixed.outside = std::move(light.outside);
  fixed.inside = std::move(light.inside);
}

// A surface that rises by s along board x turns its normal by -s times the direction of board x.
std::vector<Eigen::Vector2f> StudioScene::LightBySlope(const Fixed& fixed, const VertexLight& light) {
  std::vector<Eigen::Vector2f> out(fixed.cloth_vertices, Eigen::Vector2f::Zero());
  std::vector<float> faces(fixed.cloth_vertices, 0);
  for (size_t f = 0; f < fixed.print.of_face.size(); ++f) {
    const auto& board = fixed.print.of_face[f];
    if (std::isnan(board[0].x())) continue;
    const Face& face = fixed.faces[f];
    Eigen::Matrix2d edges;
    edges << board[1] - board[0], board[2] - board[0];
    if (!(std::abs(edges.determinant()) > 1e-12)) continue;
    Eigen::Matrix<double, 3, 2> ways;
    ways << fixed.places_mm[face[1]] - fixed.places_mm[face[0]],
        fixed.places_mm[face[2]] - fixed.places_mm[face[0]];
    const Eigen::Matrix<double, 3, 2> axes = ways * edges.inverse();
    const Eigen::Vector3f x = axes.col(0).normalized().cast<float>();
    const Eigen::Vector3f y = axes.col(1).normalized().cast<float>();
    for (const int v : face) {
      out[v] -= Eigen::Vector2f(light.flux[v].dot(x), light.flux[v].dot(y));
      faces[v] += 1;
    }
  }
  for (size_t v = 0; v < out.size(); ++v)
    if (faces[v] > 0) out[v] /= faces[v];
  return out;
}

Eigen::Vector3d StudioScene::CenterMm() const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& v : mesh_.vertices_mm) sum += v;
  return sum / std::max<double>(1, static_cast<double>(mesh_.vertices_mm.size()));
}

ShadedPoint StudioScene::ShadeAt(int face, bool from_outside, const Eigen::Vector3f& weights) const {
  const Face& corners = fixed_->faces[face];
  const std::vector<float>& side = from_outside ? fixed_->outside : fixed_->inside;
  ShadedPoint out;
  for (int i = 0; i < 3; ++i) out.light += weights[i] * side[corners[i]];
  if (!IsCloth(face)) {
    const SkinOptions& skin = fixed_->options.skin;
    const uint64_t key = MixBits(skin.seed);
    float shade = 0;
    for (int i = 0; i < 3; ++i)
      shade += weights[i] * static_cast<float>(2 * UniformOf(key, static_cast<uint64_t>(corners[i])) - 1);
    out.plain = skin.color * (1 + static_cast<float>(skin.variation) * shade);
    return out;
  }
  const auto& board = fixed_->print.of_face[face];
  out.plain = from_outside ? fixed_->options.inks.line : fixed_->options.inks.back;
  if (!from_outside || std::isnan(board[0].x())) return out;
  out.printed = true;
  for (int i = 0; i < 3; ++i) {
    out.board += weights[i] * board[i].cast<float>();
    out.light_by_slope += weights[i] * fixed_->light_by_slope[corners[i]];
  }
  return out;
}

}  // namespace weft
