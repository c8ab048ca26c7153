#include "figure/pose.h"

namespace weft {

FigurePose Mix(const FigurePose& a, const FigurePose& b, double share) {
  FigurePose out;
  out.root_mm = a.root_mm + share * (b.root_mm - a.root_mm);
  for (size_t j = 0; j < kJoints; ++j) out.rotation[j] = a.rotation[j].slerp(share, b.rotation[j]);
  return out;
}

std::array<Eigen::Isometry3d, kJoints> WorldFromRest(const Skeleton& skeleton, const FigurePose& pose) {
  std::array<Eigen::Isometry3d, kJoints> out;
  out[0] = Eigen::Translation3d(pose.root_mm) * pose.rotation[0];
  for (size_t j = 1; j < kJoints; ++j) {
    const Eigen::Translation3d pivot(skeleton.rest_mm[j]);
    out[j] = out[static_cast<size_t>(ParentOf(static_cast<Joint>(j)))] * pivot * pose.rotation[j] *
             pivot.inverse();
  }
  return out;
}

}  // namespace weft
