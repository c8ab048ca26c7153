#include "services/work/animation/rig_scale.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/median.h"

namespace weft {
namespace {

constexpr size_t kEnoughPairs = 40;
// Edges that face the camera appear longest; the longest of all are wrong cells.
constexpr double kUnforeshortened = 0.1;
// Views whose directions differ by less than this share of the distance say nothing of the unit.
constexpr double kLeastSpread = 0.15;
constexpr double kMostOff = 2;

// From the camera to the garment in mm, in the world's axes.
std::optional<Eigen::Vector3d> WayToGarment(const CameraModel& camera, const std::vector<Observation>& seen,
                                            const std::map<BoardNode, int>& vertex_of,
                                            const Template& garment, const MeshGraph& graph) {
  std::map<int, Eigen::Vector2d> pixel_of;
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  for (const Observation& o : seen) {
    const auto vertex = vertex_of.find(o.node);
    const std::optional<Ray> ray = camera.PixelRay({o.x_px, o.y_px});
    if (vertex == vertex_of.end() || !ray) continue;
    pixel_of.emplace(vertex->second, Eigen::Vector2d(o.x_px / camera.fx_px, o.y_px / camera.fy_px));
    direction += ray->direction;
  }
  std::vector<double> distance_mm;
  for (const MeshEdge& edge : graph.edges) {
    const auto a = pixel_of.find(edge.a), b = pixel_of.find(edge.b);
    if (a == pixel_of.end() || b == pixel_of.end()) continue;
    const auto& rest = garment.rest.vertices_mm;
    const double angle = (a->second - b->second).norm();
    if (angle > 0)
      distance_mm.push_back((rest[static_cast<size_t>(edge.a)] - rest[static_cast<size_t>(edge.b)]).norm() /
                            angle);
  }
  if (distance_mm.size() < kEnoughPairs) return std::nullopt;
  const auto at = distance_mm.begin() +
                  static_cast<std::ptrdiff_t>(kUnforeshortened * static_cast<double>(distance_mm.size()));
  std::nth_element(distance_mm.begin(), at, distance_mm.end());
  return *at * direction.normalized();
}

}  // namespace

std::optional<double> RigScale(const Rig& rig, const std::vector<ViewObservations>& views,
                               const Template& garment, const MeshGraph& graph) {
  std::map<BoardNode, int> vertex_of;
  for (size_t v = 0; v < garment.node_of_vertex.size(); ++v) {
    const VertexNode& node = garment.node_of_vertex[v];
    if (node.IsCell()) vertex_of.emplace(BoardNode{node.row, node.col, node.kind}, static_cast<int>(v));
  }
  std::vector<Eigen::Vector3d> centers, ways_mm;
  for (const ViewObservations& view : views) {
    const CameraModel& camera = rig.cameras[static_cast<size_t>(view.camera)];
    const std::optional<Eigen::Vector3d> way =
        WayToGarment(camera, view.observations, vertex_of, garment, graph);
    if (!way) continue;
    centers.push_back(camera.CenterWorld());
    ways_mm.push_back(*way);
  }
  if (centers.size() < 2) return std::nullopt;
  // The least squares of scale * center + way - place over scale and place.
  Eigen::Vector3d mean_center = Eigen::Vector3d::Zero(), mean_way = mean_center;
  double distance_mm = 0;
  const auto count = static_cast<double>(centers.size());
  for (size_t k = 0; k < centers.size(); ++k) {
    mean_center += centers[k] / count, mean_way += ways_mm[k] / count;
    distance_mm += ways_mm[k].norm() / count;
  }
  double together = 0, of_centers = 0, of_ways = 0;
  for (size_t k = 0; k < centers.size(); ++k) {
    const Eigen::Vector3d center = centers[k] - mean_center, way = ways_mm[k] - mean_way;
    together -= center.dot(way), of_centers += center.squaredNorm(), of_ways += way.squaredNorm();
  }
  if (std::sqrt(of_ways / count) < kLeastSpread * distance_mm || of_centers == 0) return std::nullopt;
  return together / of_centers;
}

absl::Status CheckRigScale(double scale, const std::string& rig_path, const std::string& garment_path) {
  if (scale > 1 / kMostOff && scale < kMostOff) return absl::OkStatus();
  if (!(scale > 0))
    return absl::FailedPreconditionError(absl::StrCat(
        rig_path, ": its cameras look away from each other's garment; is it the rig of this take? (template ",
        garment_path, ")"));
  const auto near = [scale](double unit) { return scale > unit / kMostOff && scale < unit * kMostOff; };
  const char* unit = near(1000)                ? "metres"
                     : near(25.4) && !near(10) ? "inches"
                     : near(10)                ? "centimetres"
                                               : "another unit";
  return absl::FailedPreconditionError(
      absl::StrCat(rig_path, ": its positions are to be multiplied by about ", absl::StrFormat("%.3g", scale),
                   " so that its cameras see the garment of ", garment_path,
                   " in one place; they seem to be in ", unit, ", and weft's are in mm"));
}

}  // namespace weft
