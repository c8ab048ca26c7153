#include "evaluation/chamfer.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace weft {
namespace {

// A k-d tree in an array: the middle point of a range divides the others by the longest side of their box.
class PointTree {
 public:
  explicit PointTree(const std::vector<Eigen::Vector3d>& points) : points_(points), axis_(points.size()) {
    Divide(0, points_.size());
  }

  double SquaredDistanceTo(const Eigen::Vector3d& p) const {
    double nearest = std::numeric_limits<double>::infinity();
    Search(p, 0, points_.size(), nearest);
    return nearest;
  }

 private:
  void Divide(size_t begin, size_t end) {
    if (end - begin < 2) return;
    Eigen::Vector3d low = points_[begin], high = low;
    for (size_t k = begin; k < end; ++k) low = low.cwiseMin(points_[k]), high = high.cwiseMax(points_[k]);
    int axis = 0;
    (high - low).maxCoeff(&axis);
    const size_t middle = begin + (end - begin) / 2;
    const auto at = [this](size_t k) { return points_.begin() + static_cast<std::ptrdiff_t>(k); };
    std::nth_element(at(begin), at(middle), at(end),
                     [axis](const auto& a, const auto& b) { return a[axis] < b[axis]; });
    axis_[middle] = axis;
    Divide(begin, middle);
    Divide(middle + 1, end);
  }

  void Search(const Eigen::Vector3d& p, size_t begin, size_t end, double& nearest) const {
    if (begin == end) return;
    const size_t middle = begin + (end - begin) / 2;
    nearest = std::min(nearest, (points_[middle] - p).squaredNorm());
    const double beyond = p[axis_[middle]] - points_[middle][axis_[middle]];
    const bool is_low = beyond < 0;
    Search(p, is_low ? begin : middle + 1, is_low ? middle : end, nearest);
    if (beyond * beyond < nearest) Search(p, is_low ? middle + 1 : begin, is_low ? end : middle, nearest);
  }

  std::vector<Eigen::Vector3d> points_;
  std::vector<int> axis_;
};

double Mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

}  // namespace

std::vector<double> NearestDistances(const std::vector<Eigen::Vector3d>& points_mm,
                                     const std::vector<Eigen::Vector3d>& others_mm) {
  const PointTree tree(others_mm);
  std::vector<double> out(points_mm.size());
  tbb::parallel_for(tbb::blocked_range<size_t>(0, out.size(), 256), [&](const auto& range) {
    for (size_t k = range.begin(); k < range.end(); ++k)
      out[k] = std::sqrt(tree.SquaredDistanceTo(points_mm[k]));
  });
  return out;
}

double ChamferMm(const std::vector<Eigen::Vector3d>& a_mm, const std::vector<Eigen::Vector3d>& b_mm) {
  return (Mean(NearestDistances(a_mm, b_mm)) + Mean(NearestDistances(b_mm, a_mm))) / 2;
}

}  // namespace weft
