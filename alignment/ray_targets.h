// Vertices that some camera saw and that have no target lie on the rays of these sights. E_Dist tells where
// on them. Without this, what a single camera sees of a fold is left to the fill.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/status.h"
#include "alignment/elastic_problem.h"
#include "alignment/mesh_graph.h"

namespace weft {

// On what line a vertex lies.
struct RayTarget {
  int vertex = -1;
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  // length 1
  double sigma_rad = 0;                                  // standard deviation per axis across it

  // From a point to the line.
  Eigen::Vector3d WayMm(const Eigen::Vector3d& point_mm) const {
    const Eigen::Vector3d offset = origin_mm - point_mm;
    return offset - direction.dot(offset) * direction;
  }
};

// InvalidArgument names the first ray whose vertex is not on the mesh, that is not finite, or whose direction
// has another length than 1.
absl::Status CheckRays(const std::vector<RayTarget>& rays, int vertices);

// How a mesh follows rays.
struct RayFit {
  double reach_mm = 25;  // rays that pass the mesh without them further off are taken for wrong; 0: all
  // A ray weighs kGain reference^2 / (sigma^2 + floor^2) across it and 0 along it; sigma is that of the ray
  // at the vertex.
  double reference_sigma_mm = 0.5;
  double floor_mm = 0.03;
  double edge_weight = 3;  // of an edge in E_Dist, times lambda
  // As RobustOptions.
  double outlier_ratio = 5;
  double least_outlier_mm = 4;
};

// The rays that pass within reach of their vertex, without those of `measured` vertices ([vertices]).
std::vector<RayTarget> RaysInReach(const std::vector<RayTarget>& rays, const std::vector<bool>& measured,
                                   const std::vector<Eigen::Vector3d>& position_mm, const RayFit& fit);

// Those that smooth cloth explains, where the mesh follows them all: as with targets, the distance of a ray
// is that to the surface without it, as far as the edges of its vertex tell.
std::vector<RayTarget> WithoutOutliers(const std::vector<RayTarget>& rays, const MeshGraph& graph,
                                       const std::vector<Eigen::Vector3d>& position_mm, const RayFit& fit);

// Adds the rays to the problem, as seen from where the vertices are.
void AddRays(const std::vector<RayTarget>& rays, const std::vector<Eigen::Vector3d>& position_mm,
             const RayFit& fit, ElasticProblem* problem);

}  // namespace weft
