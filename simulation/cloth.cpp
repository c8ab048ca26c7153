#include "simulation/cloth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"

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

struct Node {
  int vertex;
  BoardPoint place;
};
void AddFace(const Node& a, const Node& b, const Node& c, Cloth& cloth) {
  cloth.rest.faces.push_back({a.vertex, b.vertex, c.vertex});
  cloth.print.of_face.push_back({a.place, b.place, c.place});
}

// Corners counter-clockwise seen from outside. Diagonals alternate, so that the cloth bends alike in both
// diagonal directions.
void AddQuad(const std::array<Node, 4>& q, int turn, Cloth& cloth) {
  const auto at = [&](int k) { return q[(k + turn) % 4]; };
  AddFace(at(0), at(1), at(2), cloth);
  AddFace(at(0), at(2), at(3), cloth);
}

// Both edges of a slit lie on the same line of the print, a little apart in space.
void AddSlitVertices(Cloth& cloth) {
  constexpr double kApartCells = 0.02;
  const ClothOptions& o = cloth.options;
  for (const int slit : o.slits) {
    std::array<std::vector<int>, 2> edges;
    for (int i = o.slits_from + 1; i < cloth.grid_rows; ++i)
      for (int side = 0; side < 2; ++side) {
        const bool is_end = edges[side].empty();
        edges[side].push_back(is_end && side == 1 ? edges[0][0]
                                                  : static_cast<int>(cloth.rest.vertices_mm.size()));
        if (is_end && side == 1) continue;
        const double aside = is_end ? 0 : (side == 0 ? -0.5 : 0.5) * kApartCells;
        cloth.rest.vertices_mm.push_back(RestPosition(o, cloth.row_position[i], slit + aside));
        cloth.cell_of_vertex.push_back({});
      }
    cloth.slit_edges.push_back(std::move(edges));
  }
}

// The faces between columns that a slit divides. `q` has the corners of the undivided quad below line i.
void AddSlitFaces(const std::array<Node, 4>& q, int i, size_t slit, int turn, Cloth& cloth) {
  const ClothOptions& o = cloth.options;
  const int end = o.slits_from + 1;
  const double col = o.first_col + o.slits[slit];
  const auto edge = [&](int side, int line) -> Node {
    return {cloth.slit_edges[slit][side][line - end], {col, o.first_row + cloth.row_position[line]}};
  };
  if (i + 1 < end) return AddQuad(q, turn, cloth);
  if (i + 1 == end) {
    AddFace(q[0], q[1], edge(0, end), cloth);
    AddFace(q[0], edge(0, end), q[3], cloth);
    AddFace(edge(0, end), q[2], q[3], cloth);
    return;
  }
  AddQuad({q[0], q[1], edge(0, i + 1), edge(0, i)}, turn, cloth);
  AddQuad({edge(1, i), edge(1, i + 1), q[2], q[3]}, turn, cloth);
}

void AddFaces(Cloth& cloth) {
  const ClothOptions& o = cloth.options;
  const int quads_across = cloth.closed ? cloth.grid_cols : cloth.grid_cols - 1;
  for (int i = 0; i + 1 < cloth.grid_rows; ++i) {
    for (int j = 0; j < quads_across; ++j) {
      const int next = (j + 1) % cloth.grid_cols;
      const double right = next == 0 ? o.cols : cloth.col_position[next];
      const auto node = [&](int line, int grid_col, double col) -> Node {
        return {cloth.vertex_at(line, grid_col), {o.first_col + col, o.first_row + cloth.row_position[line]}};
      };
      const double left = cloth.col_position[j];
      const std::array<Node, 4> q = {node(i, j, left), node(i + 1, j, left), node(i + 1, next, right),
                                     node(i, next, right)};
      const auto slit = std::find(o.slits.begin(), o.slits.end(), j);
      if (slit == o.slits.end())
        AddQuad(q, (i + j) % 2, cloth);
      else
        AddSlitFaces(q, i, static_cast<size_t>(slit - o.slits.begin()), (i + j) % 2, cloth);
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
  for (size_t k = 0; k < slits.size(); ++k) {
    const int before = k == 0 ? 0 : slits[k - 1];
    if (shape == ClothShape::kTube || slits[k] < before + 2 || slits[k] > cols - 2)
      return absl::InvalidArgumentError(absl::StrCat(
          "cloth: a slit is at ", slits[k], ", expected in a sheet, ascending and 2 cells or more apart"));
  }
  if (slits_from < 0 || slits_from + 2 > rows)
    return absl::InvalidArgumentError(
        absl::StrCat("cloth: slits_from is ", slits_from, ", expected 0 to ", rows - 2));
  if (!(cell_mm > 0) || !std::isfinite(cell_mm))
    return absl::InvalidArgumentError(absl::StrCat("cloth: cell_mm is ", cell_mm, ", must be positive"));
  return absl::OkStatus();
}

absl::StatusOr<Cloth> BuildCloth(const ClothOptions& options) {
  WEFT_RETURN_IF_ERROR(options.Validate());
  Cloth cloth;
  cloth.options = options;
  cloth.closed = options.shape == ClothShape::kTube;
  cloth.row_position = LinePositions(options.rows, false);
  cloth.col_position = LinePositions(options.cols, cloth.closed);
  cloth.grid_rows = static_cast<int>(cloth.row_position.size());
  cloth.grid_cols = static_cast<int>(cloth.col_position.size());
  AddVertices(cloth);
  AddSlitVertices(cloth);
  AddFaces(cloth);
  return cloth;
}

std::vector<std::array<Eigen::Vector2d, 3>> FlatShape(const Cloth& cloth) {
  const double size = cloth.options.cell_mm;
  std::vector<std::array<Eigen::Vector2d, 3>> flat;
  for (const auto& corners : cloth.print.of_face)
    flat.push_back({size * corners[0], size * corners[1], size * corners[2]});
  return flat;
}

}  // namespace weft
