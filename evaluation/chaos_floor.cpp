#include "evaluation/chaos_floor.h"

#include <Eigen/Geometry>

#include <cmath>
#include <utility>

#include "alignment/vertex_normals.h"
#include "base/angles.h"

namespace weft {

void ChaosFloor::Add(double time_s, const std::vector<Eigen::Vector3d>& a_mm,
                     const std::vector<Eigen::Vector3d>& b_mm, const std::vector<Face>& faces) {
  if (time_s < kSkippedS || a_mm.empty()) return;
  ++frames_;
  double sum = 0;
  std::vector<Eigen::Vector3d> apart(a_mm.size());
  for (size_t v = 0; v < a_mm.size(); ++v) {
    apart[v] = a_mm[v] - b_mm[v];
    distance_mm_.push_back(apart[v].norm());
    sum += apart[v].norm();
    if (recent_mm_.size() == 2)
      error_jitter_mm_.push_back((recent_mm_[0][v] - 2 * recent_mm_[1][v] + apart[v]).norm());
  }
  if (recent_mm_.size() == 2) recent_mm_.erase(recent_mm_.begin());
  recent_mm_.push_back(std::move(apart));
  frame_means_mm_.push_back(sum / static_cast<double>(a_mm.size()));
  const std::vector<Eigen::Vector3d> a = VertexNormals(a_mm, faces), b = VertexNormals(b_mm, faces);
  // The sine and the cosine: acos alone has no digits left for small angles.
  for (size_t v = 0; v < a.size(); ++v)
    normals_deg_.push_back(std::atan2(a[v].cross(b[v]).norm(), a[v].dot(b[v])) / kRadPerDeg);
}

}  // namespace weft
