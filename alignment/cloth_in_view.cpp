#include "alignment/cloth_in_view.h"

#include <algorithm>
#include <optional>
#include <unordered_map>

#include "alignment/print_scale.h"
#include "alignment/vertex_normals.h"

namespace weft {
namespace {

constexpr size_t kMostVertices = 3000;
constexpr double kMinFacingCosine = 0.5;
constexpr double kMinPitchPx = 4;

struct Place {
  BoardNode node;
  Eigen::Vector3d position_mm, normal;
};

// Measured vertices with a cell, spread evenly.
std::vector<Place> MeasuredPlaces(const Template& garment, const RegisteredMesh& mesh) {
  std::vector<size_t> measured;
  for (size_t v = 0; v < mesh.state.size(); ++v)
    if (garment.node_of_vertex[v].IsCell() &&
        (mesh.state[v] == VertexState::kObserved || mesh.state[v] == VertexState::kTwoView))
      measured.push_back(v);
  const std::vector<Eigen::Vector3d> normals = VertexNormals(mesh.vertices_mm, garment.rest.faces);
  const size_t step = std::max<size_t>(1, measured.size() / kMostVertices);
  std::vector<Place> places;
  for (size_t k = 0; k < measured.size(); k += step) {
    const size_t v = measured[k];
    const VertexNode& node = garment.node_of_vertex[v];
    places.push_back({{node.row, node.col, node.kind}, mesh.vertices_mm[v], normals[v]});
  }
  return places;
}

// Where the camera should see it; nothing where it cannot.
std::optional<Eigen::Vector2d> InView(const CameraModel& camera, const Place& place, double cell_mm) {
  const Eigen::Vector3d way = camera.CenterWorld() - place.position_mm;
  const double facing = place.normal.dot(way) / way.norm();
  if (!(facing > kMinFacingCosine) || !(camera.fx_px * cell_mm * facing > kMinPitchPx * way.norm()))
    return std::nullopt;
  const std::optional<Eigen::Vector2d> pixel = camera.Project(place.position_mm);
  return pixel && camera.Contains(*pixel) ? pixel : std::nullopt;
}

}  // namespace

std::vector<ClothInView> CountClothInView(const Rig& rig, const std::vector<ViewObservations>& views,
                                          const Template& garment, const RegisteredMesh& mesh) {
  std::vector<ClothInView> counts(views.size());
  if (mesh.vertices_mm.size() != garment.node_of_vertex.size() ||
      mesh.state.size() != mesh.vertices_mm.size())
    return {};
  const std::vector<Place> places = MeasuredPlaces(garment, mesh);
  const double cell_mm = MedianLengthPerCell(
      SampleNodeEdges(garment.rest.vertices_mm, garment.rest.faces, garment.node_of_vertex));
  for (size_t k = 0; k < views.size(); ++k) {
    const CameraModel& camera = rig.cameras[views[k].camera];
    std::unordered_map<int64_t, Eigen::Vector2d> cells;
    for (const Observation& o : views[k].observations)
      if (o.node.kind == NodeKind::kCenter)
        cells.try_emplace(int64_t{o.node.row} << 32 | o.node.col, o.x_px, o.y_px);
    for (const Place& place : places) {
      const std::optional<Eigen::Vector2d> pixel = InView(camera, place, cell_mm);
      if (!pixel) continue;
      ++counts[k].vertices;
      const auto cell = cells.find(int64_t{place.node.row} << 32 | place.node.col);
      counts[k].seen += cell != cells.end() && (cell->second - *pixel).norm() < kSeenPx;
    }
  }
  return counts;
}

}  // namespace weft
