#include "simulation/printed_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace weft {
namespace {

bool IsPrinted(const std::array<BoardPoint, 3>& corners) { return !std::isnan(corners[0].x()); }

// Barycentric weights of `p` in the triangle of board coordinates; empty for a degenerate triangle.
std::optional<Eigen::Vector3d> WeightsIn(const std::array<BoardPoint, 3>& t, const BoardPoint& p) {
  const Eigen::Vector2d ab = t[1] - t[0], ac = t[2] - t[0], ap = p - t[0];
  const double det = ab.x() * ac.y() - ab.y() * ac.x();
  if (std::abs(det) < 1e-12) return std::nullopt;
  const double v = (ap.x() * ac.y() - ap.y() * ac.x()) / det;
  const double w = (ab.x() * ap.y() - ab.y() * ap.x()) / det;
  return Eigen::Vector3d(1 - v - w, v, w);
}

}  // namespace

ClothPrint PrintFromVertexNodes(const std::vector<Face>& faces,
                                const std::vector<VertexNode>& node_of_vertex) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  ClothPrint print;
  print.of_face.reserve(faces.size());
  for (const Face& face : faces) {
    std::array<BoardPoint, 3> corners;
    bool printed = true;
    for (int i = 0; i < 3; ++i) {
      const VertexNode& node = node_of_vertex[face[i]];
      const VertexNode& next = node_of_vertex[face[(i + 1) % 3]];
      printed = printed && node.row >= 0 && node.col >= 0 &&
                (node.PlaceInCells() - next.PlaceInCells()).cwiseAbs().maxCoeff() <= 1.5;
      corners[i] = node.PlaceInCells();
    }
    if (!printed) corners.fill(BoardPoint(nan, nan));
    print.of_face.push_back(corners);
  }
  return print;
}

PrintLocator::PrintLocator(const ClothPrint& print) : print_(print) {
  double x_min = 1e9, x_max = -1e9, y_min = 1e9, y_max = -1e9;
  for (const auto& corners : print_.of_face) {
    if (!IsPrinted(corners)) continue;
    for (const BoardPoint& p : corners) {
      x_min = std::min(x_min, p.x()), x_max = std::max(x_max, p.x());
      y_min = std::min(y_min, p.y()), y_max = std::max(y_max, p.y());
    }
  }
  if (x_min > x_max) {
    start_.assign(1, 0);
    return;
  }
  col_begin_ = static_cast<int>(std::floor(x_min)), col_end_ = static_cast<int>(std::ceil(x_max));
  row_begin_ = static_cast<int>(std::floor(y_min)), row_end_ = static_cast<int>(std::ceil(y_max));
  const int cols = col_end_ - col_begin_, rows = row_end_ - row_begin_;

  // Counting sort of the faces into the cells that their bounding boxes touch; ascending face order per cell.
  const auto for_cells = [&](int f, const auto& visit) {
    const auto& t = print_.of_face[f];
    if (!IsPrinted(t)) return;
    const BoardPoint low = t[0].cwiseMin(t[1]).cwiseMin(t[2]), high = t[0].cwiseMax(t[1]).cwiseMax(t[2]);
    const auto clamp = [](double v, int begin, int count) {
      return std::clamp(static_cast<int>(std::floor(v)) - begin, 0, count - 1);
    };
    for (int r = clamp(low.y() - 1e-9, row_begin_, rows); r <= clamp(high.y() + 1e-9, row_begin_, rows); ++r)
      for (int c = clamp(low.x() - 1e-9, col_begin_, cols); c <= clamp(high.x() + 1e-9, col_begin_, cols);
           ++c)
        visit(static_cast<size_t>(r) * cols + c);
  };
  const int faces = static_cast<int>(print_.of_face.size());
  start_.assign(static_cast<size_t>(rows) * cols + 1, 0);
  for (int f = 0; f < faces; ++f) for_cells(f, [&](size_t cell) { ++start_[cell + 1]; });
  for (size_t i = 1; i < start_.size(); ++i) start_[i] += start_[i - 1];
  faces_.resize(start_.back());
  std::vector<int> next(start_.begin(), start_.end() - 1);
  for (int f = 0; f < faces; ++f) for_cells(f, [&](size_t cell) { faces_[next[cell]++] = f; });
}

std::optional<SurfacePoint> PrintLocator::Find(const BoardPoint& point) const {
  const int cols = col_end_ - col_begin_, rows = row_end_ - row_begin_;
  if (cols <= 0 || rows <= 0) return std::nullopt;
  if (point.x() < col_begin_ || point.x() > col_end_ || point.y() < row_begin_ || point.y() > row_end_)
    return std::nullopt;
  const int c = std::min(static_cast<int>(std::floor(point.x())) - col_begin_, cols - 1);
  const int r = std::min(static_cast<int>(std::floor(point.y())) - row_begin_, rows - 1);
  const size_t cell = static_cast<size_t>(r) * cols + c;
  for (int k = start_[cell]; k < start_[cell + 1]; ++k) {
    const std::optional<Eigen::Vector3d> weights = WeightsIn(print_.of_face[faces_[k]], point);
    if (weights && weights->minCoeff() >= -1e-9) return SurfacePoint{faces_[k], *weights};
  }
  return std::nullopt;
}

SurfacePoint PrintLocator::Beyond(int face, const BoardPoint& point) const {
  const std::optional<Eigen::Vector3d> weights = WeightsIn(print_.of_face[face], point);
  return {face, weights.value_or(Eigen::Vector3d(1, 0, 0))};
}

Eigen::Vector3d PositionOf(const SurfacePoint& point, const std::vector<Eigen::Vector3d>& vertices_mm,
                           const std::vector<Face>& faces) {
  const Face& face = faces[point.face];
  return point.weights[0] * vertices_mm[face[0]] + point.weights[1] * vertices_mm[face[1]] +
         point.weights[2] * vertices_mm[face[2]];
}

}  // namespace weft
