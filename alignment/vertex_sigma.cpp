#include "alignment/vertex_sigma.h"

#include <algorithm>
#include <cmath>

namespace weft {
namespace {

// Standard deviation of inferred vertices: that of the nearest observed ones, plus, in quadrature,
// kInferredScale * (mean edge length) * rings. rings is the number of edges to the nearest of them.
constexpr double kInferredScale = 0.15;

// Of the variance that E_Dist takes away: a pull that noise alone hardly ever causes.
constexpr double kExpectedPull = 3;

double SizeMm(const TriangleMesh& mesh) {
  Eigen::Vector3d low = mesh.vertices_mm[0], high = low;
  for (const Eigen::Vector3d& v : mesh.vertices_mm) low = low.cwiseMin(v), high = high.cwiseMax(v);
  return (high - low).norm();
}

// Each vertex without a value takes the mean of its neighbours that got theirs in the ring before.
void SpreadOutwards(const MeshGraph& graph, const std::vector<int>& rings, std::vector<float>* values) {
  std::vector<int> order;
  for (int v = 0; v < graph.vertices; ++v)
    if (rings[v] > 0) order.push_back(v);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return rings[a] < rings[b]; });
  for (const int v : order) {
    float sum = 0;
    int count = 0;
    for (int i = graph.first[v]; i < graph.first[v + 1]; ++i) {
      if (rings[graph.neighbor[i]] != rings[v] - 1) continue;
      sum += (*values)[graph.neighbor[i]];
      ++count;
    }
    (*values)[v] = sum / count;
  }
}

}  // namespace

double SmoothedVarianceShare(double coupling) {
  const double x = kMostEigenvalue * coupling;
  return x < 1e-6 ? 1 : std::log1p(x) / x;
}

std::vector<float> VertexSigmas(const AlignmentModel& model, const std::vector<VertexTarget>& targets,
                                const std::vector<Eigen::Vector3d>& position_mm,
                                const AlignOptions& options) {
  const MeshGraph& graph = model.graph();
  const double stretch = options.elastic.lambda * options.elastic.distortion.stretch;
  std::vector<float> sigmas(graph.vertices, 0);
  std::vector<bool> measured(graph.vertices, false);
  for (const VertexTarget& t : targets) {
    const DetectionOptions& detection = options.detection;
    const double fold_mm2 = t.fold_covariance_mm2.trace() / 3;
    const double noise_mm2 = t.sigma_mm > 0 ? std::max(t.sigma_mm * t.sigma_mm - fold_mm2,
                                                       detection.min_sigma_mm * detection.min_sigma_mm)
                                            : detection.reference_sigma_mm * detection.reference_sigma_mm;
    const double weight = detection.weigh_by_sigma
                              ? std::pow(detection.reference_sigma_mm, 2) /
                                    (noise_mm2 + detection.cloth_sigma_mm * detection.cloth_sigma_mm)
                              : 1;
    const double share = SmoothedVarianceShare(stretch / weight);
    const double pulled_mm2 = (position_mm[t.vertex] - t.position_mm).squaredNorm() / 3;
    const double excess_mm2 = std::max(0.0, pulled_mm2 - kExpectedPull * noise_mm2 * (1 - share));
    sigmas[t.vertex] = static_cast<float>(std::sqrt(share * noise_mm2 + fold_mm2 + excess_mm2));
    measured[t.vertex] = true;
  }
  const std::vector<int> rings = RingDistance(graph, measured);
  SpreadOutwards(graph, rings, &sigmas);
  const double scale_mm = kInferredScale * model.mean_edge_mm();
  const float size_mm = static_cast<float>(SizeMm(model.rest()));
  for (int v = 0; v < graph.vertices; ++v) {
    if (rings[v] < 0) {
      sigmas[v] = size_mm;
    } else if (rings[v] > 0) {
      const double grown = scale_mm * rings[v];
      sigmas[v] = std::min(size_mm, static_cast<float>(std::hypot(sigmas[v], grown)));
    }
  }
  return sigmas;
}

}  // namespace weft
