// Faces in a uniform grid of cells: which pairs come near each other.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "alignment/mesh.h"

namespace weft {

struct FaceBox {
  Eigen::Array3f low, high;

  bool Overlaps(const FaceBox& other) const {
    return low.x() <= other.high.x() && other.low.x() <= high.x() && low.y() <= other.high.y() &&
           other.low.y() <= high.y() && low.z() <= other.high.z() && other.low.z() <= high.z();
  }
};

// Vertices must be finite. Thread safety: const functions may be called from any number of threads.
class FaceGrid {
 public:
  // Boxes are wider than their faces by margin_mm on each side, and by what rounding to floats takes.
  FaceGrid(const std::vector<Eigen::Vector3d>& vertices_mm, const std::vector<Face>& faces, double margin_mm);

  int cells() const { return static_cast<int>(first_.size()) - 1; }

  // Calls visit(a, b), a < b, for the pairs of faces whose boxes overlap, each in one of the cells only.
  template <typename Visit>
  void VisitPairs(int first_cell, int last_cell, const Visit& visit) const {
    for (int cell = first_cell; cell < last_cell; ++cell) {
      for (int i = first_[cell]; i + 1 < first_[cell + 1]; ++i) {
        const FaceBox& box = boxes_[faces_[i]];
        for (int j = i + 1; j < first_[cell + 1]; ++j) {
          const FaceBox& other = boxes_[faces_[j]];
          // Of the cells that both touch, the one where their overlap begins.
          if (box.Overlaps(other) && Index(CellAt(box.low.max(other.low))) == cell)
            visit(faces_[i], faces_[j]);
        }
      }
    }
  }

 private:
  Eigen::Array3i CellAt(const Eigen::Array3f& point) const { return (point * per_mm_).cast<int>(); }
  int Index(const Eigen::Array3i& cell) const {
    return (cell.z() * size_[1] + cell.y()) * size_[0] + cell.x();
  }
  template <typename Visit>
  void VisitCells(const FaceBox& box, const Visit& visit) const {
    const Eigen::Array3i from = CellAt(box.low), to = CellAt(box.high);
    for (int z = from.z(); z <= to.z(); ++z) {
      for (int y = from.y(); y <= to.y(); ++y) {
        for (int x = from.x(); x <= to.x(); ++x) visit(Index({x, y, z}));
      }
    }
  }
  Eigen::Array3f SetBoxes(const std::vector<Eigen::Vector3d>& vertices_mm, const std::vector<Face>& faces,
                          double margin_mm);
  void SetCells(const Eigen::Array3f& high);

  std::vector<FaceBox> boxes_;  // relative to the mesh's low corner, so that floats are fine enough
  float per_mm_ = 0;
  int size_[3] = {};
  std::vector<int> first_;  // [cells + 1]
  std::vector<int> faces_;  // ordered within a cell
};

}  // namespace weft
