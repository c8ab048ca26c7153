#include "animation/rays/ray_polish.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/median.h"
#include "base/status_macros.h"

namespace weft {
namespace {

constexpr double kLeastSpreadMm = 0.5;
// Wrong cells lie whole cells away. What is nearer, in edges, is cloth that the rays around it do not tell
// of.
constexpr double kLeastOutlier = 0.4;

// How far each ray is from where the rays around it, of the same view, say that the cloth is.
std::vector<double> DistancesToOthers(const MeshGraph& graph, const std::vector<VertexRay>& rays,
                                      const std::vector<bool>& rejected,
                                      const std::vector<Eigen::Vector3d>& position_mm) {
  std::vector<Eigen::Vector3d> way(graph.vertices);
  std::vector<int> ray_of(graph.vertices, -1);
  std::vector<double> out(rays.size());
  int views = 0;
  for (const VertexRay& ray : rays) views = std::max(views, ray.view + 1);
  for (int view = 0; view < views; ++view) {
    std::fill(ray_of.begin(), ray_of.end(), -1);
    for (size_t i = 0; i < rays.size(); ++i) {
      if (rays[i].view != view) continue;
      way[rays[i].vertex] = rays[i].OffsetTo(position_mm[rays[i].vertex]);
      ray_of[rays[i].vertex] = static_cast<int>(i);
    }
    for (int v = 0; v < graph.vertices; ++v) {
      if (ray_of[v] < 0) continue;
      Eigen::Vector3d around = Eigen::Vector3d::Zero();
      int count = 0;
      for (int i = graph.first[v]; i < graph.first[v + 1]; ++i) {
        const int other = graph.neighbor[i];
        if (ray_of[other] < 0 || rejected[ray_of[other]]) continue;
        around += way[other];
        ++count;
      }
      out[ray_of[v]] = (count > 0 ? Eigen::Vector3d(way[v] - around / count) : way[v]).norm();
    }
  }
  return out;
}

}  // namespace

absl::Status PolishOptions::Validate() const {
  const auto bad = [](const char* what) {
    return absl::InvalidArgumentError(std::string("polish: ") + what);
  };
  if (!(carrier_sigma_mm > 0)) return bad("carrier_sigma_mm must be positive");
  if (rounds < 1 || rounds > 10) return bad("rounds must be 1 to 10");
  if (!(outlier_spreads > 0)) return bad("outlier_spreads must be positive");
  return fit.Validate();
}

RayPolish::RayPolish(const AlignmentModel& model, const EdgeLengths& lengths, const PolishOptions& options)
    : model_(model), options_(options), fit_(model.graph(), lengths, options.fit) {}

absl::StatusOr<PolishedMesh> RayPolish::Polish(const std::vector<Eigen::Vector3d>& carrier_mm,
                                               const std::vector<Eigen::Vector3d>& start_mm,
                                               const std::vector<VertexRay>& rays) {
  PolishedMesh out;
  out.position_mm = start_mm;
  out.rejected.assign(rays.size(), false);
  const double weak = 1 / (options_.carrier_sigma_mm * options_.carrier_sigma_mm);
  for (int round = 0; round < options_.rounds; ++round) {
    // What disagrees with the rays around it, measured where the mesh is now.
    const std::vector<double> off = DistancesToOthers(model_.graph(), rays, out.rejected, out.position_mm);
    const double spread = std::max(kLeastSpreadMm, Median(off));
    const double most = std::max(options_.outlier_spreads * spread, kLeastOutlier * model_.mean_edge_mm());
    const std::vector<bool> before = out.rejected;
    for (size_t i = 0; i < rays.size(); ++i) out.rejected[i] = off[i] > most;
    if (round > 0 && out.rejected == before) break;
    std::vector<RayEvidence> evidence(carrier_mm.size());
    for (size_t v = 0; v < evidence.size(); ++v) {
      evidence[v].information = weak * Eigen::Matrix3d::Identity();
      evidence[v].moment = weak * carrier_mm[v];
    }
    for (size_t i = 0; i < rays.size(); ++i)
      if (const int v = rays[i].vertex; !out.rejected[i]) evidence[v].Add(rays[i], out.position_mm[v], 1);
    WEFT_RETURN_IF_ERROR(fit_.Solve(evidence, carrier_mm, &out.position_mm, round > 0));
  }
  return out;
}

}  // namespace weft
