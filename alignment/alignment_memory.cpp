#include "alignment/alignment_memory.h"

namespace weft {

size_t AlignmentMemoryBytes(int vertices) {
  constexpr size_t kField3 = 3 * sizeof(float);
  // Position, target, gradients of this and the next point, direction, reduced gradient, start, step, change.
  const size_t fields = 9 + 2 * static_cast<size_t>(kCorrections);
  const size_t records = 3 * 4 * sizeof(float);  // packed positions, rotations of this and the last fit
  const size_t weights = 6 * sizeof(float);
  const size_t problem = sizeof(Eigen::Vector3d) + sizeof(Eigen::Matrix3d);
  const size_t deformation = sizeof(Eigen::Vector3d) + 2 * sizeof(Eigen::Matrix3d);  // one copy of rotations
  return static_cast<size_t>(vertices) * (fields * kField3 + records + weights + problem + deformation);
}

}  // namespace weft
