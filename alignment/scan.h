// A scan of the same frame by any other method, as evidence for cloth that the pattern does not show.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "alignment/mesh.h"

namespace weft {

// Points of a surface; normals are empty, or one of length 1 per point, pointing outwards.
struct Scan {
  std::string name = "the scan";  // in messages
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

// How a scan lies on a mesh.
struct ScanFit {
  int near = 0;      // points that are near enough to a vertex
  int vertices = 0;  // vertices that are the nearest of a point
  // Of `near`, by their normals: those that face as the mesh does, and those that face the other way. Without
  // normals all of them are `outward`.
  int outward = 0, inward = 0;
  bool is_turned = false;  // the normals of the scan point inwards
  // Of the points of the side that counts: along the mesh's normal.
  double median_distance_mm = 0;
};

// Points nearer than half the distance of `options` say whether normals are turned: on the inner side of
// thick cloth they are right.
ScanFit FitOfScan(const Scan& scan, const std::vector<Eigen::Vector3d>& vertices_mm,
                  const std::vector<Face>& faces, const AssociationOptions& options);

// InvalidArgument, with the unit, where the scan finds the mesh only when its numbers are taken as metres,
// centimetres, inches or feet, or where it is a hundredth as large as the mesh. `fit` is that of the scan as
// it is.
absl::Status CheckScanUnit(const Scan& scan, const ScanFit& fit,
                           const std::vector<Eigen::Vector3d>& vertices_mm, const std::vector<Face>& faces,
                           const AssociationOptions& options);

// What an alignment made of a scan.
struct ScanUse {
  int found = 0;     // points that found a vertex: near enough, and not of the other side of the cloth
  int vertices = 0;  // vertices without a target that were drawn to it
  double median_distance_mm = 0;  // of those points from the cloth before it followed them
  bool is_turned = false;         // its normals pointed inwards, and were turned
};

}  // namespace weft
