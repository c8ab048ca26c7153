#include "evaluation/jitter.h"

namespace weft {

std::vector<double> SecondDifferences(const std::vector<Eigen::Vector3d>& before_mm,
                                      const std::vector<Eigen::Vector3d>& now_mm,
                                      const std::vector<Eigen::Vector3d>& after_mm) {
  std::vector<double> length_mm;
  length_mm.reserve(now_mm.size());
  for (size_t v = 0; v < now_mm.size(); ++v)
    length_mm.push_back((before_mm[v] - 2 * now_mm[v] + after_mm[v]).norm());
  return length_mm;
}

std::vector<double> ErrorChanges(const std::vector<Eigen::Vector3d>& now_mm,
                                 const std::vector<Eigen::Vector3d>& true_now_mm,
                                 const std::vector<Eigen::Vector3d>& after_mm,
                                 const std::vector<Eigen::Vector3d>& true_after_mm) {
  std::vector<double> length_mm;
  length_mm.reserve(now_mm.size());
  for (size_t v = 0; v < now_mm.size(); ++v)
    length_mm.push_back(((after_mm[v] - now_mm[v]) - (true_after_mm[v] - true_now_mm[v])).norm());
  return length_mm;
}

}  // namespace weft
