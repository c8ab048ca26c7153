#include "animation/ray_polish.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "base/median.h"

namespace weft {
namespace {

constexpr double kLeastSpreadMm = 0.5;
// Wrong cells lie whole cells away. What is nearer, in edges, is cloth that the rays around it do not tell
// of.
constexpr double kLeastOutlier = 0.4;

// The carrier as rest shape, with the cloth's lengths. Edges that the carrier has no direction for stay.
SlicedMesh RestOf(const AlignmentModel& model, const EdgeLengths& lengths,
                  const std::vector<Eigen::Vector3d>& carrier_mm) {
  const MeshGraph& graph = model.graph();
  TriangleMesh rest{carrier_mm, model.rest().faces};
  SlicedMesh out = SliceMesh(rest, graph);
  std::vector<std::vector<std::pair<int, float>>> of(graph.vertices);
  for (size_t e = 0; e < graph.edges.size(); ++e) {
    const int a = graph.edges[e].a, b = graph.edges[e].b;
    const auto now = static_cast<float>((carrier_mm[a] - carrier_mm[b]).norm());
    const float mean = lengths.mean_mm[e], spread = std::max(0.0f, lengths.spread_mm[e]);
    const float length = std::clamp(now, mean - spread, mean + spread);
    of[a].emplace_back(b, length), of[b].emplace_back(a, length);
  }
  for (int slice = 0; slice < out.slices; ++slice)
    for (int slot = out.first_slot[slice]; slot < out.first_slot[slice + 1]; ++slot)
      for (int lane = 0; lane < kSliceLanes; ++lane) {
        const int v = slice * kSliceLanes + lane, at = slot * kSliceLanes + lane, other = out.neighbor[at];
        if (v >= out.vertices || other == v) continue;
        const float now = std::hypot(out.rest_x[at], out.rest_y[at], out.rest_z[at]);
        if (!(now > 1e-3f)) continue;
        const auto found =
            std::find_if(of[v].begin(), of[v].end(), [&](const auto& e) { return e.first == other; });
        const float scale = found->second / now;
        out.rest_x[at] *= scale, out.rest_y[at] *= scale, out.rest_z[at] *= scale;
      }
  return out;
}

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
      way[rays[i].vertex] = rays[i].WayTo(position_mm[rays[i].vertex]);
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
  if (!(stretch_sigma_mm > 0)) return bad("stretch_sigma_mm must be positive");
  if (!(bending >= 0)) return bad("bending must not be negative");
  if (!(carrier_sigma_mm > 0)) return bad("carrier_sigma_mm must be positive");
  if (iterations < 1) return bad("iterations must be at least 1");
  if (rounds < 1 || rounds > 10) return bad("rounds must be 1 to 10");
  if (!(outlier_spreads > 0)) return bad("outlier_spreads must be positive");
  return absl::OkStatus();
}

absl::StatusOr<PolishedMesh> PolishToRays(const AlignmentModel& model, const EdgeLengths& lengths,
                                          const std::vector<Eigen::Vector3d>& carrier_mm,
                                          const std::vector<VertexRay>& rays, const PolishOptions& options) {
  const MeshGraph& graph = model.graph();
  const SlicedMesh rest = RestOf(model, lengths, carrier_mm);
  ElasticOptions elastic;
  // E_Dist weighs the length with `stretch`; lambda makes a deviation of stretch_sigma_mm cost 1.
  elastic.distortion.bending = options.bending;
  elastic.lambda = 1 / (elastic.distortion.stretch * options.stretch_sigma_mm * options.stretch_sigma_mm);
  elastic.max_iterations = options.iterations;
  elastic.tolerance = 1e-5;
  Deformation state{carrier_mm, std::vector<Eigen::Matrix3d>(carrier_mm.size(), Eigen::Matrix3d::Identity())};
  PolishedMesh out;
  out.rejected.assign(rays.size(), false);
  for (int round = 0; round < options.rounds; ++round) {
    // What disagrees with the rays around it, measured where the mesh is now.
    const std::vector<double> off = DistancesToOthers(graph, rays, out.rejected, state.position_mm);
    const double spread = std::max(kLeastSpreadMm, Median(off));
    const double most = std::max(options.outlier_spreads * spread, kLeastOutlier * model.mean_edge_mm());
    for (size_t i = 0; i < rays.size(); ++i) out.rejected[i] = off[i] > most;
    ElasticProblem problem;
    problem.has_free_directions = true;
    problem.targets_mm = carrier_mm;
    problem.weights.assign(carrier_mm.size(), Eigen::Matrix3d::Identity() /
                                                  (options.carrier_sigma_mm * options.carrier_sigma_mm));
    for (size_t i = 0; i < rays.size();) {
      const int v = rays[i].vertex;
      RayEvidence evidence;
      for (; i < rays.size() && rays[i].vertex == v; ++i)
        if (!out.rejected[i]) evidence.Add(rays[i], state.position_mm[v], 1);
      if (evidence.rays == 0) continue;
      const Eigen::Matrix3d sum = problem.weights[v] + evidence.information;
      problem.targets_mm[v] +=
          sum.ldlt().solve(evidence.moment - evidence.information * problem.targets_mm[v]);
      problem.weights[v] = sum;
    }
    const auto report = SolveElastic(rest, graph, problem, elastic, &state);
    if (!report.ok()) return report.status();
    out.iterations += report->iterations;
  }
  out.position_mm = std::move(state.position_mm);
  return out;
}

}  // namespace weft
