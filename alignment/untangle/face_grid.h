// Faces in a uniform grid of cells: which pairs come near each other.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "alignment/mesh.h"

namespace weft {

struct FaceBox {
  Eigen::Array3f low, high;

  bool Overlaps(const FaceBox& other) const { return (low <= other.high).all() && (other.low <= high).all(); }
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
    Eigen::Array<float, Eigen::Dynamic, 6> sides;  // of the cell's boxes: low, and high negated
    Eigen::ArrayXf apart;
    for (int cell = first_cell; cell < last_cell; ++cell) {
      const int* face = faces_.data() + first_[cell];
      const int count = first_[cell + 1] - first_[cell];
      if (count < 2) continue;
      if (count > sides.rows()) {
        sides.resize(2 * count, 6);
        apart.resize(2 * count);
      }
      for (int i = 0; i < count; ++i)
        sides.row(i) << boxes_[face[i]].low.transpose(), -boxes_[face[i]].high.transpose();
      for (int i = 0; i + 1 < count; ++i) {
        const FaceBox& box = boxes_[face[i]];
        // The widest gap between this box and each later one along any axis.
        const int later = count - i - 1;
        apart.head(later) = (sides.col(0).segment(i + 1, later) - box.high.x())
                                .max(sides.col(1).segment(i + 1, later) - box.high.y())
                                .max(sides.col(2).segment(i + 1, later) - box.high.z())
                                .max(sides.col(3).segment(i + 1, later) + box.low.x())
                                .max(sides.col(4).segment(i + 1, later) + box.low.y())
                                .max(sides.col(5).segment(i + 1, later) + box.low.z());
        for (int j = 0; j < later; ++j) {
          if (apart[j] > 0) continue;
          const int other = face[i + 1 + j];
          if (IsTold(box, boxes_[other], cell)) visit(face[i], other);
        }
      }
    }
  }

  // The same, in the same order, for the pairs with a face of `some` ([faces]).
  template <typename Visit>
  void VisitPairsOf(const std::vector<bool>& some, int first_cell, int last_cell, const Visit& visit) const {
    std::vector<int> of_cell;  // places in faces_
    for (int cell = first_cell; cell < last_cell; ++cell) {
      of_cell.clear();
      for (int i = first_[cell]; i < first_[cell + 1]; ++i)
        if (some[faces_[i]]) of_cell.push_back(i);
      const auto try_pair = [&](int i, int j) {
        const FaceBox &one = boxes_[faces_[i]], &other = boxes_[faces_[j]];
        if (one.Overlaps(other) && IsTold(one, other, cell)) visit(faces_[i], faces_[j]);
      };
      auto next = of_cell.begin();
      for (int i = first_[cell]; next != of_cell.end(); ++i) {
        if (i == *next) {
          ++next;
          for (int j = i + 1; j < first_[cell + 1]; ++j) try_pair(i, j);
        } else {
          for (auto j = next; j != of_cell.end(); ++j) try_pair(i, *j);
        }
      }
    }
  }

 private:
  Eigen::Array3i CellAt(const Eigen::Array3f& point) const { return (point * per_mm_).cast<int>(); }
  int Index(const Eigen::Array3i& cell) const {
    return (cell.z() * size_[1] + cell.y()) * size_[0] + cell.x();
  }
  // Of the cells that both touch, the one where their overlap begins.
  bool IsTold(const FaceBox& one, const FaceBox& other, int cell) const {
    return Index(CellAt(one.low.max(other.low))) == cell;
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
