#include "evaluation/vertex_views.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>

#include "alignment/vertex_normals.h"
#include "base/status_macros.h"
#include "simulation/printed_mesh.h"

namespace weft {

absl::Status ViewingOptions::Validate() const {
  if (!(max_facing_deg > 0 && max_facing_deg < 90))
    return absl::InvalidArgumentError("max_facing_deg must lie between 0 and 90");
  if (!(min_pitch_px >= 0)) return absl::InvalidArgumentError("min_pitch_px must not be negative");
  if (!(clearance_mm >= 0)) return absl::InvalidArgumentError("clearance_mm must not be negative");
  return absl::OkStatus();
}

absl::StatusOr<VisibleMesh> VisibleMesh::Build(std::vector<Eigen::Vector3d> vertices_mm,
                                               const std::vector<Face>& faces, double cell_mm) {
  WEFT_ASSIGN_OR_RETURN(RayScene rays, RayScene::Build(vertices_mm, faces));
  VisibleMesh mesh;
  mesh.normals_ = VertexNormals(vertices_mm, faces);
  mesh.vertices_mm_ = std::move(vertices_mm);
  mesh.cell_mm_ = cell_mm;
  mesh.rays_ = std::move(rays);
  return mesh;
}

VertexView VisibleMesh::Observe(int vertex, const CameraModel& camera, const ViewingOptions& options) const {
  VertexView view;
  const Eigen::Vector3d &place = vertices_mm_[vertex], &normal = normals_[vertex];
  const Eigen::Vector3d eye = camera.CenterWorld();
  view.facing_cosine = static_cast<float>(normal.dot((eye - place).normalized()));
  if (!(view.facing_cosine > std::cos(options.max_facing_deg * std::numbers::pi / 180))) return view;
  const std::optional<Projection> at = camera.ProjectWithDerivative(place);
  if (!at || !camera.Contains(at->pixel_px)) return view;
  const Eigen::Vector3d u = normal.unitOrthogonal(), w = normal.cross(u);
  const Eigen::Vector2d du = at->d_pixel_d_world * u, dw = at->d_pixel_d_world * w;
  view.pitch_px = static_cast<float>(cell_mm_ * std::sqrt(std::abs(du.x() * dw.y() - du.y() * dw.x())));
  view.seen = view.pitch_px >= options.min_pitch_px && rays_.InSight(eye, place, options.clearance_mm);
  return view;
}

std::vector<VertexView> VisibleMesh::Observe(const CameraModel& camera, const ViewingOptions& options) const {
  std::vector<VertexView> views(vertices_mm_.size());
  tbb::parallel_for(tbb::blocked_range<size_t>(0, views.size(), 512), [&](const auto& range) {
    for (size_t v = range.begin(); v < range.end(); ++v)
      views[v] = Observe(static_cast<int>(v), camera, options);
  });
  return views;
}

double CellPitchMm(const Template& garment) {
  const ClothPrint print = PrintFromVertexNodes(garment.rest.faces, garment.node_of_vertex);
  double area_mm2 = 0, cells = 0;
  for (size_t f = 0; f < print.of_face.size(); ++f) {
    const auto& board = print.of_face[f];
    if (std::isnan(board[0].x())) continue;
    const Eigen::Vector2d b = board[1] - board[0], c = board[2] - board[0];
    const Face& face = garment.rest.faces[f];
    const Eigen::Vector3d& origin = garment.rest.vertices_mm[face[0]];
    cells += std::abs(b.x() * c.y() - b.y() * c.x());
    area_mm2 +=
        (garment.rest.vertices_mm[face[1]] - origin).cross(garment.rest.vertices_mm[face[2]] - origin).norm();
  }
  return cells > 0 ? std::sqrt(area_mm2 / cells) : 0;
}

std::vector<bool> ReadAround(const std::vector<VertexNode>& node_of_vertex,
                             const std::vector<Observation>& observations) {
  std::set<std::pair<int, int>> read;
  for (const Observation& o : observations)
    if (o.node.kind == NodeKind::kCenter) read.emplace(o.node.row, o.node.col);
  std::vector<bool> around;
  around.reserve(node_of_vertex.size());
  for (const VertexNode& node : node_of_vertex) {
    const int cells = node.IsCell() ? 9 : 4, side = node.IsCell() ? 3 : 2;
    int count = 0;
    for (int k = 0; k < cells; ++k)
      count += static_cast<int>(read.count({node.row + k / side - 1, node.col + k % side - 1}));
    around.push_back(node.row >= 0 && 2 * count > cells);
  }
  return around;
}

}  // namespace weft
