#include "alignment/untangle/face_grid.h"

#include <cmath>

namespace weft {
namespace {

constexpr double kMaxCells = 1 << 23;
constexpr double kCellPerExtent = 3;       // size of a cell against the mean extent of a face's box
constexpr double kFloatRounding = 2.5e-7;  // of the mesh's extent

}  // namespace

FaceGrid::FaceGrid(const std::vector<Eigen::Vector3d>& vertices_mm, const std::vector<Face>& faces,
                   double margin_mm) {
  if (faces.empty()) {
    first_ = {0};
    return;
  }
  SetCells(SetBoxes(vertices_mm, faces, margin_mm));
}

// Returns the high corner.
Eigen::Array3f FaceGrid::SetBoxes(const std::vector<Eigen::Vector3d>& vertices_mm,
                                  const std::vector<Face>& faces, double margin_mm) {
  Eigen::Vector3d low = vertices_mm[faces[0][0]], high = low;
  for (const Face& face : faces) {
    for (const int v : face) {
      low = low.cwiseMin(vertices_mm[v]);
      high = high.cwiseMax(vertices_mm[v]);
    }
  }
  const double wider = margin_mm + kFloatRounding * (high - low).maxCoeff();
  low.array() -= wider;
  boxes_.reserve(faces.size());
  for (const Face& face : faces) {
    const Eigen::Vector3d &a = vertices_mm[face[0]], &b = vertices_mm[face[1]], &c = vertices_mm[face[2]];
    const Eigen::Array3d from = (a.cwiseMin(b).cwiseMin(c) - low).array() - wider;
    const Eigen::Array3d to = (a.cwiseMax(b).cwiseMax(c) - low).array() + wider;
    boxes_.push_back({from.max(0).cast<float>(), to.cast<float>()});
  }
  return ((high - low).array() + wider).cast<float>();
}

void FaceGrid::SetCells(const Eigen::Array3f& high) {
  double extent = 0;
  for (const FaceBox& box : boxes_) extent += (box.high - box.low).maxCoeff();
  double cell = std::max(kCellPerExtent * extent / static_cast<double>(boxes_.size()), 1e-9);
  const auto count = [&] { return (high.cast<double>() / cell + 1).floor().prod(); };
  while (count() > kMaxCells) cell *= 1.25;
  per_mm_ = static_cast<float>(1 / cell);
  for (int axis = 0; axis < 3; ++axis) size_[axis] = CellAt(high)[axis] + 1;

  first_.assign(static_cast<size_t>(size_[0]) * size_[1] * size_[2] + 1, 0);
  for (const FaceBox& box : boxes_) VisitCells(box, [&](int index) { ++first_[index + 1]; });
  for (size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
  faces_.resize(first_.back());
  std::vector<int> next(first_.begin(), first_.end() - 1);
  for (size_t f = 0; f < boxes_.size(); ++f) {
    VisitCells(boxes_[f], [&](int index) { faces_[next[index]++] = static_cast<int>(f); });
  }
}

}  // namespace weft
