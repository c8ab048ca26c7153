#include <algorithm>
#include <cstdint>
#include <functional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "alignment/mapped_mesh.h"
#include "alignment/template_check.h"
#include "base/status_macros.h"

namespace weft {
namespace {

// The row of a node of these faces, -1 of none.
int FirstRow(std::span<const Face> faces, const std::vector<VertexNode>& nodes) {
  for (const Face& face : faces)
    for (const int v : face)
      if (nodes[static_cast<size_t>(v)].row >= 0) return nodes[static_cast<size_t>(v)].row;
  return -1;
}

// How many cells of a map lie outside of the board's panels, once they are moved by some rows and columns.
int64_t CountOutside(const std::vector<VertexNode>& nodes, const Board& board, int rows, int cols) {
  return std::count_if(nodes.begin(), nodes.end(), [&](const VertexNode& node) {
    if (!node.IsCell()) return false;
    const int row = node.row + rows, col = node.col + cols;
    return !board.Contains(row, col) || board.panels[static_cast<size_t>(row) * board.cols + col] == 0;
  });
}

absl::Status CheckPanels(const std::vector<VertexNode>& nodes, const Board& board) {
  // Masks are drawn by hand as well: some cells at their borders say nothing. A map of full panels that is
  // moved by one cell has 0.5 % outside, or more.
  constexpr double kOutside = 0.002;
  if (board.panels.empty()) return absl::OkStatus();
  const auto cells =
      std::count_if(nodes.begin(), nodes.end(), [](const VertexNode& n) { return n.IsCell(); });
  const double most = kOutside * static_cast<double>(cells);
  const int64_t outside = CountOutside(nodes, board, 0, 0);
  if (static_cast<double>(outside) <= most) return absl::OkStatus();
  std::string hint;
  for (const auto& [rows, cols] : {std::pair(-1, -1), std::pair(-1, 0), std::pair(0, -1), std::pair(1, 1)}) {
    if (static_cast<double>(CountOutside(nodes, board, rows, cols)) > most) continue;
    hint = absl::StrCat(" All lie within them when rows are moved by ", rows, " and columns by ", cols,
                        ": rows and columns count from 0.");
    break;
  }
  return absl::InvalidArgumentError(
      absl::StrCat(outside, " of ", cells, " cells of the map lie outside of the panels of board ", board.id,
                   ".", hint, " Give the map of this board, and panels.png as the cloth was cut"));
}

// `cell_mm_at`: from the row of a node.
absl::StatusOr<TemplateSize> SizeOf(const Template& garment, bool any_scale,
                                    const std::function<double(int)>& cell_mm_at) {
  TemplateSize size;
  for (const GarmentFaces& one : GarmentsOf(garment)) {
    const std::string whose = one.id.empty() ? "" : absl::StrCat("garment ", one.id, ": ");
    const std::vector<NodeEdge> edges =
        SampleNodeEdges(garment.rest.vertices_mm, one.faces, garment.node_of_vertex);
    const PrintScale scale =
        MeasurePrintScale(edges, cell_mm_at(FirstRow(one.faces, garment.node_of_vertex)));
    size.scales.push_back(scale);
    if (edges.empty()) {
      size.unchecked.push_back(absl::StrCat(
          whose, "no edge joins two cells of the board: order, side and size of the mesh are not checked"));
    } else if (scale.median == 0) {
      size.unchecked.push_back(absl::StrCat(
          whose, "the board does not say how large its cells are: the size of the mesh is not checked"));
    }
    absl::Status status = OfGarment(one.id, CheckPrintScale(scale));
    if (!status.ok() && !any_scale) return status;
    const std::string words = PrintScaleWords(scale);
    if (!words.empty()) size.off.push_back(whose + words);
  }
  return size;
}

}  // namespace

absl::StatusOr<TemplateSize> CheckTemplateOnBoard(const Template& garment, const Board& board,
                                                  bool any_scale) {
  WEFT_RETURN_IF_ERROR(CheckPanels(garment.node_of_vertex, board));
  return SizeOf(garment, any_scale, [&board](int row) { return CellMmAt(board, row); });
}

absl::StatusOr<TemplateSize> CheckTemplateSize(const Template& garment, double cell_mm, bool any_scale) {
  return SizeOf(garment, any_scale, [cell_mm](int) { return cell_mm; });
}

}  // namespace weft
