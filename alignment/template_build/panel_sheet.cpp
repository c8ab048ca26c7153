#include "alignment/template_build/panel_sheet.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "absl/strings/str_cat.h"
#include "alignment/template_build/mesh_topology.h"
#include "base/status_macros.h"

namespace weft {
namespace {

// Triangles between cells, as cell indices, counter-clockwise seen from the printed side.
std::vector<Face> CellFaces(const BoardPanels& panels, const std::vector<bool>& active) {
  std::vector<Face> faces;
  for (int row = 0; row + 1 < panels.rows; ++row) {
    for (int col = 0; col + 1 < panels.cols; ++col) {
      // Counter-clockwise on the board with its rows downwards.
      const std::array<int, 4> block = {row * panels.cols + col, (row + 1) * panels.cols + col,
                                        (row + 1) * panels.cols + col + 1, row * panels.cols + col + 1};
      // The panel of the block is that of most of its cells.
      for (int missing = -1; missing < 4; ++missing) {
        int panel = -1;
        bool whole = true;
        for (int i = 0; i < 4; ++i) {
          if (i == missing) continue;
          const int here = active[block[i]] ? panels.panel_of_cell[block[i]] : -1;
          whole = whole && here >= 0 && (panel < 0 || here == panel);
          panel = here;
        }
        if (!whole) continue;
        const auto add = [&](int a, int b, int c) { faces.push_back({block[a], block[b], block[c]}); };
        if (missing >= 0) {
          add((missing + 1) % 4, (missing + 2) % 4, (missing + 3) % 4);
        } else if ((row + col) % 2 == 0) {
          add(0, 1, 2), add(0, 2, 3);
        } else {
          add(0, 1, 3), add(1, 2, 3);
        }
        break;
      }
    }
  }
  return faces;
}

// Cells without faces, and those at which two pieces touch: more than one border leaves them.
std::vector<int> LooseCells(const std::vector<bool>& active, const std::vector<Face>& faces) {
  std::vector<std::pair<int, int>> half_edges;
  half_edges.reserve(3 * faces.size());
  std::vector<bool> used(active.size(), false);
  for (const Face& face : faces) {
    for (int i = 0; i < 3; ++i) {
      half_edges.emplace_back(face[i], face[(i + 1) % 3]);
      used[face[i]] = true;
    }
  }
  std::sort(half_edges.begin(), half_edges.end());
  std::vector<int> borders(active.size(), 0);
  for (const auto& [from, to] : half_edges) {
    borders[from] += !std::binary_search(half_edges.begin(), half_edges.end(), std::make_pair(to, from));
  }
  std::vector<int> loose;
  for (size_t cell = 0; cell < active.size(); ++cell) {
    if (active[cell] && (!used[cell] || borders[cell] > 1)) loose.push_back(static_cast<int>(cell));
  }
  return loose;
}

// Takes out pieces of fewer cells than a panel has. Returns the number of pieces that stay and numbers the
// cells by them, -1 for none.
int KeepPanels(const std::vector<Face>& faces, int min_cells, std::vector<bool>* active,
               std::vector<int>* panel_of_cell) {
  std::vector<int> parent(active->size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (const Face& face : faces) {
    for (const int v : face) {
      const int a = root(v), b = root(face[0]);
      parent[std::max(a, b)] = std::min(a, b);
    }
  }
  std::vector<int> size(active->size(), 0), panel(active->size(), -1);
  for (size_t cell = 0; cell < active->size(); ++cell) {
    if ((*active)[cell]) ++size[root(static_cast<int>(cell))];
  }
  int panels = 0;
  panel_of_cell->assign(active->size(), -1);
  for (int cell = 0; cell < static_cast<int>(active->size()); ++cell) {
    if (!(*active)[cell]) continue;
    const int first = root(cell);
    if (size[first] < min_cells) {
      (*active)[cell] = false;
      continue;
    }
    if (panel[first] < 0) panel[first] = panels++;
    (*panel_of_cell)[cell] = panel[first];
  }
  return panels;
}

}  // namespace

absl::StatusOr<PanelSheet> MakePanelSheet(const BoardPanels& panels, double cell_mm, int min_panel_cells) {
  std::vector<bool> active(panels.panel_of_cell.size());
  for (size_t cell = 0; cell < active.size(); ++cell) active[cell] = panels.panel_of_cell[cell] >= 0;
  std::vector<Face> faces;
  for (bool settled = false; !settled;) {
    faces = CellFaces(panels, active);
    const std::vector<int> loose = LooseCells(active, faces);
    for (const int cell : loose) active[cell] = false;
    settled = loose.empty();
  }
  std::vector<int> panel_of_cell;
  PanelSheet sheet;
  sheet.panels = KeepPanels(faces, min_panel_cells, &active, &panel_of_cell);
  if (sheet.panels == 0) {
    return absl::FailedPreconditionError(absl::StrCat(
        "no panel of ", min_panel_cells, " or more connected cells; are the clouds of this board?"));
  }

  std::vector<int> cells;
  for (int cell = 0; cell < static_cast<int>(active.size()); ++cell) {
    if (active[cell]) cells.push_back(cell);
  }
  std::stable_sort(cells.begin(), cells.end(),
                   [&](int a, int b) { return panel_of_cell[a] < panel_of_cell[b]; });
  std::vector<int> vertex_of_cell(active.size(), -1);
  for (const int cell : cells) {
    vertex_of_cell[cell] = static_cast<int>(sheet.cell_of_vertex.size());
    const int row = cell / panels.cols, col = cell % panels.cols;
    sheet.cell_of_vertex.push_back({row, col});
    sheet.panel_of_vertex.push_back(panel_of_cell[cell]);
    sheet.flat.vertices_mm.emplace_back((col + 0.5) * cell_mm, (row + 0.5) * cell_mm, 0);
  }
  for (const Face& face : faces) {
    if (!active[face[0]]) continue;
    sheet.flat.faces.push_back({vertex_of_cell[face[0]], vertex_of_cell[face[1]], vertex_of_cell[face[2]]});
  }
  WEFT_ASSIGN_OR_RETURN(MeshTopology topology,
                        CheckTopology(static_cast<int>(sheet.cell_of_vertex.size()), sheet.flat.faces));
  sheet.loops = std::move(topology.loops);
  return sheet;
}

}  // namespace weft
