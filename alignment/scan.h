// A scan of the same frame by any other method, as evidence for cloth that the pattern does not show.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/status.h"
#include "alignment/mesh.h"

namespace weft {

// Points of a surface; normals are empty, or one of length 1 per point, pointing outwards.
struct Scan {
  std::vector<Eigen::Vector3d> points_mm;
  std::vector<Eigen::Vector3d> normals;
};

// Which points of a scan speak for which vertex.
struct AssociationOptions {
  double max_distance_mm = 6;
  double max_normal_angle_deg = 60;  // between scan and mesh, where the scan has normals

  absl::Status Validate() const;
};

// A vertex with the scan points that are closest to it.
struct ScanPull {
  int vertex = 0;
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();  // mean of those points
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();       // of the mesh at the vertex
  int points = 0;
};

// Reduced association of Eq. 4 of the paper. Every scan point is assigned to the closest vertex. The
// target of a vertex is the mean of its points; vertices without points have no entry. Points of a vertex
// for which `wanted` is false are discarded. Ordered by vertex, the same at any thread count.
std::vector<ScanPull> AssociateScan(const Scan& scan, const std::vector<Eigen::Vector3d>& vertices_mm,
                                    const std::vector<Face>& faces, const std::vector<bool>& wanted,
                                    const AssociationOptions& options);

}  // namespace weft
