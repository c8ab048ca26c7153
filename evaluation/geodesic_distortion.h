// How far a registered mesh is from an isometric deformation of its template (paper, section 7.1.3).
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "alignment/mesh.h"

namespace weft {

struct GeodesicOptions {
  int sources = 20;  // vertices that distances are measured from, drawn at random without repetition
  uint64_t seed = 1;

  absl::Status Validate() const;
};

// Over all pairs of a source and a vertex that a path connects: the change of their geodesic distance.
struct DistortionScore {
  double mean_mm = 0;                // of the absolute changes
  double mean_relative = 0;          // of the absolute changes by the distance at rest
  std::vector<double> of_vertex_mm;  // [vertices], mean over the sources; NaN where none reaches the vertex
};

// Keeps the template's distances. Immutable; any number of threads may measure at once.
class GeodesicDistortion {
 public:
  // Exact distances (geodesics.h), parallel over the sources in the calling thread's TBB arena; the same
  // numbers at any thread count. InvalidArgument: options, a mesh that GeodesicMesh refuses.
  static absl::StatusOr<GeodesicDistortion> Build(const TriangleMesh& rest, const GeodesicOptions& options);

  // InvalidArgument: another number of vertices than the template's, vertices that are not finite.
  absl::StatusOr<DistortionScore> Measure(const std::vector<Eigen::Vector3d>& vertices_mm) const;

  const std::vector<int>& sources() const { return sources_; }

 private:
  std::vector<Face> faces_;
  size_t vertices_ = 0;
  std::vector<int> sources_;
  std::vector<std::vector<float>> rest_mm_;  // [sources][vertices]
};

}  // namespace weft
