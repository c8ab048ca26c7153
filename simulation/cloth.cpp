#include "simulation/cloth.h"

#include <array>
#include <cmath>
#include <numbers>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

// Positions of grid lines in cells: the edge, every cell centre, and the other edge unless it is the same.
std::vector<double> LinePositions(int cells, bool closed) {
  std::vector<double> out = {0};
  for (int i = 0; i < cells; ++i) out.push_back(i + 0.5);
  if (!closed) out.push_back(cells);
  return out;
}

Eigen::Vector3d RestPosition(const ClothOptions& o, double row, double col) {
  const double y = (row - o.rows / 2.0) * o.cell_mm;
  const double along = (col - o.cols / 2.0) * o.cell_mm;
  if (o.shape == ClothShape::kSheet) return {along, y, 0};
  const double radius = o.cols * o.cell_mm / (2 * std::numbers::pi);
  const double angle = along / radius;
  return {radius * std::sin(angle), y, -radius * std::cos(angle)};
}

void AddVertices(Cloth& cloth) {
  const ClothOptions& o = cloth.options;
  cloth.vertex_of_grid.assign(static_cast<size_t>(cloth.grid_rows) * cloth.grid_cols, -1);
  const auto add = [&](int i, int j, VertexNode cell) {
    cloth.vertex_of_grid[static_cast<size_t>(i) * cloth.grid_cols + j] =
        static_cast<int>(cloth.rest.vertices_mm.size());
    cloth.rest.vertices_mm.push_back(RestPosition(o, cloth.row_position[i], cloth.col_position[j]));
    cloth.cell_of_vertex.push_back(cell);
  };
  for (int r = 0; r < o.rows; ++r)
    for (int c = 0; c < o.cols; ++c) add(r + 1, c + 1, {o.first_row + r, o.first_col + c});
  for (int i = 0; i < cloth.grid_rows; ++i)
    for (int j = 0; j < cloth.grid_cols; ++j)
      if (cloth.vertex_at(i, j) < 0) add(i, j, {});
}

void AddFaces(Cloth& cloth) {
  const ClothOptions& o = cloth.options;
  const int quads_across = cloth.closed ? cloth.grid_cols : cloth.grid_cols - 1;
  for (int i = 0; i + 1 < cloth.grid_rows; ++i) {
    for (int j = 0; j < quads_across; ++j) {
      const int next = (j + 1) % cloth.grid_cols;
      const double right = next == 0 ? o.cols : cloth.col_position[next];
      const std::array<int, 4> v = {cloth.vertex_at(i, j), cloth.vertex_at(i + 1, j),
                                    cloth.vertex_at(i + 1, next), cloth.vertex_at(i, next)};
      const auto place = [&](double col, double row) {
        return BoardPoint(o.first_col + col, o.first_row + row);
      };
      const double left = cloth.col_position[j], top = cloth.row_position[i], low = cloth.row_position[i + 1];
      const std::array<BoardPoint, 4> p = {place(left, top), place(left, low), place(right, low),
                                           place(right, top)};
      // Diagonals alternate, so that the cloth bends alike in both diagonal directions.
      const int turn = (i + j) % 2;
      for (const std::array<int, 3>& k : {std::array<int, 3>{0, 1, 2}, std::array<int, 3>{0, 2, 3}}) {
        const std::array<int, 3> q = {(k[0] + turn) % 4, (k[1] + turn) % 4, (k[2] + turn) % 4};
        cloth.rest.faces.push_back({v[q[0]], v[q[1]], v[q[2]]});
        cloth.print.of_face.push_back({p[q[0]], p[q[1]], p[q[2]]});
      }
    }
  }
}

}  // namespace

absl::Status ClothOptions::Validate() const {
  const int fewest_cols = shape == ClothShape::kTube ? 8 : 4;
  if (rows < 4 || rows > 4096)
    return absl::InvalidArgumentError(absl::StrCat("cloth: rows is ", rows, ", expected 4 to 4096"));
  if (cols < fewest_cols || cols > 4096)
    return absl::InvalidArgumentError(
        absl::StrCat("cloth: cols is ", cols, ", expected ", fewest_cols, " to 4096"));
  if (first_row < 0 || first_col < 0)
    return absl::InvalidArgumentError("cloth: first_row and first_col must not be negative");
  if (!(cell_mm > 0) || !std::isfinite(cell_mm))
    return absl::InvalidArgumentError(absl::StrCat("cloth: cell_mm is ", cell_mm, ", must be positive"));
  return absl::OkStatus();
}

absl::StatusOr<Cloth> BuildCloth(const ClothOptions& options) {
  if (absl::Status status = options.Validate(); !status.ok()) return status;
  Cloth cloth;
  cloth.options = options;
  cloth.closed = options.shape == ClothShape::kTube;
  cloth.row_position = LinePositions(options.rows, false);
  cloth.col_position = LinePositions(options.cols, cloth.closed);
  cloth.grid_rows = static_cast<int>(cloth.row_position.size());
  cloth.grid_cols = static_cast<int>(cloth.col_position.size());
  AddVertices(cloth);
  AddFaces(cloth);
  return cloth;
}

}  // namespace weft
