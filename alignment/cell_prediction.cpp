#include "alignment/cell_prediction.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"

namespace weft {
namespace {

// Of the mean edge: what is nearer to a vertex does not hide it.
constexpr double kClearanceEdges = 0.3;

// Places in a 3x3 neighbourhood.
constexpr int kUp = 1, kLeft = 3, kMiddle = 4, kRight = 5, kDown = 7;

double MeanEdgeOfRest_mm(const std::vector<Eigen::Vector3d>& vertices_mm, const std::vector<Face>& faces) {
  double sum = 0;
  for (const Face& f : faces) {
    for (int k = 0; k < 3; ++k) sum += (vertices_mm[f[k]] - vertices_mm[f[(k + 1) % 3]]).norm();
  }
  return faces.empty() ? 0 : sum / (3.0 * static_cast<double>(faces.size()));
}

// Half the way between the neighbours on both sides, or all of it to the only one; false without any.
template <typename Vector>
bool EdgeBetween(const Vector* low, const Vector& middle, const Vector* high, Vector* edge) {
  if (low && high) {
    *edge = 0.5 * (*high - *low);
  } else if (high) {
    *edge = *high - middle;
  } else if (low) {
    *edge = middle - *low;
  }
  return low || high;
}

}  // namespace

absl::Status PredictionOptions::Validate() const {
  if (!(max_facing_deg > 0 && max_facing_deg < 90)) {
    return absl::InvalidArgumentError("prediction.max_facing_deg must lie in 0 to 90");
  }
  return absl::OkStatus();
}

std::vector<CellNeighborhood> FindCellNeighborhoods(const Template& garment) {
  const std::vector<VertexNode>& cells = garment.node_of_vertex;
  CellNeighborhood none;
  none.fill(-1);
  std::vector<CellNeighborhood> out(cells.size(), none);
  for (size_t v = 0; v < cells.size(); ++v) {
    if (cells[v].IsCell()) out[v][kMiddle] = static_cast<int>(v);
  }
  // Edges of the mesh between neighbours on the board.
  for (const Face& face : garment.rest.faces) {
    for (int k = 0; k < 3; ++k) {
      const int a = face[k], b = face[(k + 1) % 3];
      const int dr = cells[b].row - cells[a].row, dc = cells[b].col - cells[a].col;
      if (!cells[a].IsCell() || !cells[b].IsCell() || std::max(std::abs(dr), std::abs(dc)) != 1) continue;
      out[a][kMiddle + 3 * dr + dc] = b;
      out[b][kMiddle - 3 * dr - dc] = a;
    }
  }
  // Diagonals that no edge follows, by way of a side.
  const std::vector<CellNeighborhood> by_edges = out;
  for (size_t v = 0; v < cells.size(); ++v) {
    for (const int vertical : {kUp, kDown}) {
      for (const int horizontal : {kLeft, kRight}) {
        int& diagonal = out[v][vertical + horizontal - kMiddle];
        if (const int by = by_edges[v][vertical]; diagonal < 0 && by >= 0)
          diagonal = by_edges[by][horizontal];
        if (const int by = by_edges[v][horizontal]; diagonal < 0 && by >= 0)
          diagonal = by_edges[by][vertical];
      }
    }
  }
  return out;
}

absl::StatusOr<PredictedSurface> PredictedSurface::Build(const Template& garment,
                                                         const std::vector<CellNeighborhood>& neighborhoods,
                                                         const RegisteredMesh& mesh,
                                                         const PredictionOptions& options) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  const size_t vertices = garment.node_of_vertex.size();
  if (mesh.vertices_mm.size() != vertices || mesh.sigma_mm.size() != vertices ||
      neighborhoods.size() != vertices) {
    return absl::InvalidArgumentError(absl::StrCat("prediction: a mesh of ", mesh.vertices_mm.size(),
                                                   " vertices for a template of ", vertices));
  }
  WEFT_ASSIGN_OR_RETURN(RayScene rays, RayScene::Build(mesh.vertices_mm, garment.rest.faces));
  PredictedSurface surface;
  surface.garment_ = &garment;
  surface.neighborhoods_ = &neighborhoods;
  surface.vertices_mm_ = mesh.vertices_mm;
  surface.sigma_mm_ = mesh.sigma_mm;
  surface.rays_ = std::move(rays);
  surface.clearance_mm_ = kClearanceEdges * MeanEdgeOfRest_mm(garment.rest.vertices_mm, garment.rest.faces);
  surface.min_facing_cosine_ = std::cos(options.max_facing_deg * std::numbers::pi / 180);
  return surface;
}

std::vector<CellInView> PredictedSurface::CellsIn(const CameraModel& camera) const {
  const size_t vertices = vertices_mm_.size();
  const Eigen::Vector3d eye = camera.CenterWorld();
  std::vector<Eigen::Vector2d> pixel(vertices);
  std::vector<bool> in_picture(vertices, false);
  for (size_t v = 0; v < vertices; ++v) {
    if ((*neighborhoods_)[v][kMiddle] < 0) continue;
    const std::optional<Eigen::Vector2d> p = camera.Project(vertices_mm_[v]);
    if (p) pixel[v] = *p;
    in_picture[v] = p.has_value();
  }
  std::vector<CellInView> cells;
  std::vector<bool> in_sight(vertices, false);
  for (size_t v = 0; v < vertices; ++v) {
    if (!in_picture[v] || !camera.Contains(pixel[v])) continue;
    const auto at = [&]<typename Value>(const std::vector<Value>& values, int k) -> const Value* {
      const int other = (*neighborhoods_)[v][k];
      return other >= 0 && in_picture[other] ? &values[other] : nullptr;
    };
    Eigen::Vector2d a, b;
    Eigen::Vector3d a_mm, b_mm;
    if (!EdgeBetween(at(pixel, kLeft), pixel[v], at(pixel, kRight), &a) ||
        !EdgeBetween(at(pixel, kUp), pixel[v], at(pixel, kDown), &b) ||
        !EdgeBetween(at(vertices_mm_, kLeft), vertices_mm_[v], at(vertices_mm_, kRight), &a_mm) ||
        !EdgeBetween(at(vertices_mm_, kUp), vertices_mm_[v], at(vertices_mm_, kDown), &b_mm)) {
      continue;
    }
    // Rows run downwards, so the normal towards whoever reads the board is that of (rows, columns).
    const Eigen::Vector3d normal = b_mm.cross(a_mm).normalized(), way = eye - vertices_mm_[v];
    if (!(normal.dot(way) > min_facing_cosine_ * way.norm())) continue;
    if (!rays_.InSight(eye, vertices_mm_[v], clearance_mm_)) continue;
    in_sight[v] = true;
    CellInView& out = cells.emplace_back();
    out.vertex = static_cast<int>(v);
    out.cell.row = garment_->node_of_vertex[v].row;
    out.cell.col = garment_->node_of_vertex[v].col;
    const Eigen::Vector<float, 6> f = (Eigen::Vector<double, 6>() << pixel[v], a, b).finished().cast<float>();
    out.cell.pose = {f[0], f[1], f[2], f[3], f[4], f[5]};
    const double depth_mm = (camera.rotation * vertices_mm_[v] + camera.translation_mm).z();
    out.cell.sigma_px = static_cast<float>(sigma_mm_[v] * std::max(camera.fx_px, camera.fy_px) / depth_mm);
  }
  for (CellInView& out : cells) {
    for (int k = 0; k < 9; ++k) {
      const int other = (*neighborhoods_)[out.vertex][k];
      out.cell.in_sight[k] = other >= 0 && in_sight[other] ? 1.0f : 0.0f;
    }
  }
  return cells;
}

}  // namespace weft
