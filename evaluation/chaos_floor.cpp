#include "evaluation/chaos_floor.h"

#include <cmath>

#include "alignment/vertex_normals.h"
#include "base/angles.h"

namespace weft {

void ChaosFloor::Add(double time_s, const std::vector<Eigen::Vector3d>& a_mm,
                     const std::vector<Eigen::Vector3d>& b_mm, const std::vector<Face>& faces) {
  if (time_s < kSkippedS || a_mm.empty()) return;
  ++frames_;
  double sum = 0;
  for (size_t v = 0; v < a_mm.size(); ++v) {
    const double distance = (a_mm[v] - b_mm[v]).norm();
    distance_mm_.push_back(distance);
    sum += distance;
  }
  frame_means_mm_.push_back(sum / static_cast<double>(a_mm.size()));
  const std::vector<Eigen::Vector3d> a = VertexNormals(a_mm, faces), b = VertexNormals(b_mm, faces);
  // The sine and the cosine: acos alone has no digits left for small angles.
  for (size_t v = 0; v < a.size(); ++v)
    normals_deg_.push_back(std::atan2(a[v].cross(b[v]).norm(), a[v].dot(b[v])) / kRadPerDeg);
}

}  // namespace weft
