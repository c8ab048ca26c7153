#include "alignment/template_build/corner_vertices.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace weft {
namespace {

// The vertex of each cell in the box of cells that the sheet covers.
class CellVertices {
 public:
  explicit CellVertices(const PanelSheet& sheet) : sheet_(sheet) {
    for (const VertexNode& cell : sheet.cell_of_vertex) {
      rows_ = std::max(rows_, cell.row + 1);
      cols_ = std::max(cols_, cell.col + 1);
    }
    vertex_.assign(static_cast<size_t>(rows_) * cols_, -1);
    for (size_t v = 0; v < sheet.cell_of_vertex.size(); ++v) {
      const VertexNode& cell = sheet.cell_of_vertex[v];
      vertex_[static_cast<size_t>(cell.row) * cols_ + cell.col] = static_cast<int>(v);
    }
  }

  // -1 where the panel has no such cell.
  int At(int panel, int row, int col) const {
    if (row < 0 || col < 0 || row >= rows_ || col >= cols_) return -1;
    const int v = vertex_[static_cast<size_t>(row) * cols_ + col];
    return v >= 0 && sheet_.panel_of_vertex[v] == panel ? v : -1;
  }

 private:
  const PanelSheet& sheet_;
  int rows_ = 0, cols_ = 0;
  std::vector<int> vertex_;
};

using MaybePoint = std::optional<Eigen::Vector3d>;

// Half way between the second and the third of four samples: the polynomial through those that are there.
// Empty where one of these two is missing.
MaybePoint HalfWay(const std::array<MaybePoint, 4>& at) {
  if (!at[1] || !at[2]) return std::nullopt;
  if (at[0] && at[3]) return (9 * (*at[1] + *at[2]) - *at[0] - *at[3]) / 16;
  if (at[0]) return (6 * *at[1] + 3 * *at[2] - *at[0]) / 8;
  if (at[3]) return (6 * *at[2] + 3 * *at[1] - *at[3]) / 8;
  return (*at[1] + *at[2]) / 2;
}

}  // namespace

CutSheet CutAtCorners(const PanelSheet& sheet, int first_corner) {
  const CellVertices vertices(sheet);
  CutSheet cut;
  std::vector<bool> whole(sheet.cell_of_vertex.size(), false);  // the block to the lower right of a cell
  for (size_t v = 0; v < sheet.cell_of_vertex.size(); ++v) {
    const int panel = sheet.panel_of_vertex[v];
    const auto [row, col, kind] = sheet.cell_of_vertex[v];
    const std::array<int, 4> around = {static_cast<int>(v), vertices.At(panel, row, col + 1),
                                       vertices.At(panel, row + 1, col),
                                       vertices.At(panel, row + 1, col + 1)};
    if (*std::min_element(around.begin(), around.end()) < 0) continue;
    const int corner = first_corner + static_cast<int>(cut.corners.size());
    cut.corners.push_back({{row + 1, col + 1, NodeKind::kCorner}, around});
    whole[v] = true;
    // Counter-clockwise on the board with its rows downwards, as the sheet's own.
    const std::array<int, 4> ring = {around[0], around[2], around[3], around[1]};
    for (int i = 0; i < 4; ++i) cut.faces.push_back({ring[i], ring[(i + 1) % 4], corner});
  }
  for (const Face& face : sheet.flat.faces) {
    int row = sheet.cell_of_vertex[face[0]].row, col = sheet.cell_of_vertex[face[0]].col;
    for (const int v : face) {
      row = std::min(row, sheet.cell_of_vertex[v].row);
      col = std::min(col, sheet.cell_of_vertex[v].col);
    }
    const int first = vertices.At(sheet.panel_of_vertex[face[0]], row, col);
    if (first < 0 || !whole[first]) cut.faces.push_back(face);
  }
  return cut;
}

std::vector<Eigen::Vector3d> CornerPlaces(const PanelSheet& sheet, const std::vector<CornerVertex>& corners,
                                          const std::vector<Eigen::Vector3d>& position_mm) {
  const CellVertices vertices(sheet);
  std::vector<Eigen::Vector3d> places_mm;
  places_mm.reserve(corners.size());
  for (const CornerVertex& corner : corners) {
    const int panel = sheet.panel_of_vertex[corner.around[0]];
    std::array<MaybePoint, 4> rows;
    for (int i = 0; i < 4; ++i) {
      std::array<MaybePoint, 4> cols;
      for (int k = 0; k < 4; ++k) {
        const int v = vertices.At(panel, corner.node.row - 2 + i, corner.node.col - 2 + k);
        if (v >= 0) cols[k] = position_mm[v];
      }
      rows[i] = HalfWay(cols);
    }
    places_mm.push_back(*HalfWay(rows));
  }
  return places_mm;
}

void AddCornerVertices(const PanelSheet& sheet, RestShapeProblem* problem,
                       std::vector<Eigen::Vector3d>* rest_mm, std::vector<VertexNode>* nodes,
                       std::vector<Eigen::Vector2d>* texture_mm) {
  CutSheet cut = CutAtCorners(sheet, static_cast<int>(rest_mm->size()));
  const std::vector<Eigen::Vector3d> places_mm = CornerPlaces(sheet, cut.corners, *rest_mm);
  problem->flat_mm.resize(rest_mm->size(), Eigen::Vector3d::Zero());
  for (size_t i = 0; i < cut.corners.size(); ++i) {
    Eigen::Vector3d flat_mm = Eigen::Vector3d::Zero();
    Eigen::Vector2d in_texture_mm = Eigen::Vector2d::Zero();
    for (const int v : cut.corners[i].around) {
      flat_mm += problem->flat_mm[v] / 4;
      in_texture_mm += (*texture_mm)[v] / 4;
    }
    rest_mm->push_back(places_mm[i]);
    nodes->push_back(cut.corners[i].node);
    problem->flat_mm.push_back(flat_mm);
    texture_mm->push_back(in_texture_mm);
  }
  const int before = std::exchange(problem->panel_faces, static_cast<int>(cut.faces.size()));
  cut.faces.insert(cut.faces.end(), problem->faces.begin() + before, problem->faces.end());
  problem->faces = std::move(cut.faces);
}

}  // namespace weft
