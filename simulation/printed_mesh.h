// Surfaces that carry the print of a board, and the way from a board coordinate to a point of the surface.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "absl/status/status.h"
#include "alignment/mesh.h"
#include "alignment/template.h"

namespace weft {

// Position on the board in cells: x is the column, y the row. Cell (r, c) covers [c, c+1] x [r, r+1] and
// has its centre at (c + 0.5, r + 0.5). Corner (r, c) of the board is at (c, r).
using BoardPoint = Eigen::Vector2d;

// The print of a mesh: board coordinates per face corner, so that the two sides of a seam may differ.
// A face without print (seam tape) holds NaN.
struct ClothPrint {
  std::vector<std::array<BoardPoint, 3>> of_face;  // [faces]
};

// The print of a template's mesh: faces whose three vertices have neighbouring nodes (at most 1.5 cells
// apart) are printed, the others are seams without print. Sizes must match the mesh.
ClothPrint PrintFromVertexNodes(const std::vector<Face>& faces,
                                const std::vector<VertexNode>& node_of_vertex);

// A point of a surface: face and barycentric weights of its corners.
struct SurfacePoint {
  int face = -1;
  Eigen::Vector3d weights = Eigen::Vector3d::Zero();
};

// Finds the place of a board coordinate on a printed mesh. Build once per print, use from any number of
// threads; positions of the vertices do not matter.
class PrintLocator {
 public:
  explicit PrintLocator(const ClothPrint& print);

  // The face of lowest index that covers the point; empty where the cloth does not carry that place.
  std::optional<SurfacePoint> Find(const BoardPoint& point) const;

  // The place of a board coordinate in the plane of a printed face, also outside of it: weights may be
  // negative.
  SurfacePoint Beyond(int face, const BoardPoint& point) const;

  // Board cells covered by the print: [row_begin, row_end) x [col_begin, col_end).
  int row_begin() const { return row_begin_; }
  int row_end() const { return row_end_; }
  int col_begin() const { return col_begin_; }
  int col_end() const { return col_end_; }

 private:
  ClothPrint print_;
  int row_begin_ = 0, row_end_ = 0, col_begin_ = 0, col_end_ = 0;
  std::vector<int> start_;  // [cells + 1] into faces_
  std::vector<int> faces_;
};

// Position of a surface point, [mm].
Eigen::Vector3d PositionOf(const SurfacePoint& point, const std::vector<Eigen::Vector3d>& vertices_mm,
                           const std::vector<Face>& faces);

}  // namespace weft
