#include "services/formats/files/polygon_triangles.h"

#include <Eigen/Geometry>
#include <limits>
#include <numeric>

namespace weft {
namespace {

// Of a polygon that need not be flat (Newell).
Eigen::Vector3d NormalOf(const std::vector<Eigen::Vector3d>& corners) {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (size_t i = 0; i < corners.size(); ++i)
    normal += (corners[i] - corners[0]).cross(corners[(i + 1) % corners.size()] - corners[0]);
  return normal;
}

class EarCutter {
 public:
  explicit EarCutter(const std::vector<Eigen::Vector3d>& corners)
      : at_(corners), normal_(NormalOf(corners)), ring_(corners.size()) {
    std::iota(ring_.begin(), ring_.end(), 0);
  }

  std::vector<std::array<int, 3>> Cut() {
    std::vector<std::array<int, 3>> triangles;
    while (ring_.size() > 3) {
      const size_t ear = BestEar();
      triangles.push_back(Around(ear));
      ring_.erase(ring_.begin() + static_cast<std::ptrdiff_t>(ear));
    }
    triangles.push_back({ring_[0], ring_[1], ring_[2]});
    return triangles;
  }

 private:
  std::array<int, 3> Around(size_t i) const {
    const size_t n = ring_.size();
    return {ring_[(i + n - 1) % n], ring_[i], ring_[(i + 1) % n]};
  }

  // Twice the signed area, seen along the normal.
  double Area(int a, int b, int c) const { return (at_[b] - at_[a]).cross(at_[c] - at_[a]).dot(normal_); }

  bool IsEar(const std::array<int, 3>& triangle) const {
    const auto [a, b, c] = triangle;
    if (!(Area(a, b, c) > 0)) return false;
    for (const int other : ring_) {
      if (other == a || other == b || other == c) continue;
      if (Area(a, b, other) >= 0 && Area(b, c, other) >= 0 && Area(c, a, other) >= 0) return false;
    }
    return true;
  }

  // By the shortest diagonal, the first among equals; 0 where there is none.
  size_t BestEar() const {
    size_t best = 0;
    double shortest = std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < ring_.size(); ++i) {
      const std::array<int, 3> triangle = Around(i);
      const double length = (at_[triangle[2]] - at_[triangle[0]]).squaredNorm();
      if (length < shortest && IsEar(triangle)) best = i, shortest = length;
    }
    return best;
  }

  const std::vector<Eigen::Vector3d>& at_;
  const Eigen::Vector3d normal_;
  std::vector<int> ring_;  // corners that are left
};

}  // namespace

std::vector<std::array<int, 3>> TrianglesOfPolygon(const std::vector<Eigen::Vector3d>& corners) {
  return EarCutter(corners).Cut();
}

}  // namespace weft
