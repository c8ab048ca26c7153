// The graph's root and the prior's numbers that explain what a few views see (Halimi et al. 2022, Eq. 7).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "absl/status/status.h"
#include "animation/paper/deformation_graph.h"
#include "animation/paper/graph_prior.h"
#include "animation/rays/evidence.h"

namespace weft {

struct GraphTrackerOptions {
  int max_rays = 1500;
  int min_rays = 60;     // fewer: lost
  double spread_mm = 3;  // what the prior leaves of a mesh, per axis
  double robust_spreads = 3;
  // As of TrackerOptions: what the prior leaves is alike in neighbours.
  double rays_of_view = 70;
  double agreeing_mm = 60;  // rays agree that pass their vertex within this
  double min_agreeing_share = 0.5;
  int max_steps = 8;

  absl::Status Validate() const;
};

struct GraphState {
  Eigen::Isometry3d root = Eigen::Isometry3d::Identity();
  Eigen::VectorXd z;  // [latents]
};

struct TrackedGraph {
  GraphState state;
  double agreeing_share = 0;
  bool lost = false;
};

// Minimises sum of rho(distance from the ray / spread) + |z|^2 by Gauss-Newton, rho that of Geman and
// McClure. The last frame is where it starts, and nothing else; without one each view alone gives starts, as
// of ViewTracker. Deterministic. Not for use by two threads at once.
class GraphTracker {
 public:
  // Graph and prior must outlive it and fit each other.
  GraphTracker(const DeformationGraph& graph, const GraphPrior& prior, const GraphTrackerOptions& options);

  // Rays are ordered by vertex.
  TrackedGraph Follow(const std::vector<VertexRay>& rays);
  std::vector<Eigen::Vector3d> MeshOf(const GraphState& state) const;
  void Reset() { last_.reset(); }

 private:
  struct Fit {
    GraphState state;
    double cost = 0;
  };
  void Improve(const std::vector<VertexRay>& rays, int steps, Fit* fit) const;
  std::vector<double> Weigh(const std::vector<VertexRay>& rays, const std::vector<Eigen::Vector3d>& points,
                            double widening, double* cost) const;
  std::vector<Eigen::Vector3d> PointsOf(const std::vector<VertexRay>& rays, const GraphState& state) const;
  Fit StartAnew(const std::vector<VertexRay>& rays) const;
  double AgreeingShare(const std::vector<VertexRay>& rays, const GraphState& state) const;

  const DeformationGraph& graph_;
  const GraphPrior& prior_;
  GraphTrackerOptions options_;
  Eigen::Vector3d middle_mm_;  // of the likeliest mesh
  Eigen::Vector3d long_axis_;
  std::optional<GraphState> last_;
};

}  // namespace weft
