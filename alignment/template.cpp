#include "alignment/template.h"

#include <algorithm>
#include <charconv>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/file/content_hash.h"

namespace weft {
namespace {

// Next number of a line; false where there is none.
bool TakeInteger(std::string_view* line, int* value) {
  const size_t begin = line->find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) return false;
  const char* end = line->data() + line->size();
  const auto [rest, error] = std::from_chars(line->data() + begin, end, *value);
  if (error != std::errc() || (rest != end && *rest != ' ' && *rest != '\t' && *rest != '\r')) return false;
  line->remove_prefix(rest - line->data());
  return true;
}

}  // namespace

absl::Status CheckVertexNodes(const std::vector<VertexNode>& nodes, size_t vertices, const Board& board) {
  if (nodes.size() != vertices) {
    return absl::InvalidArgumentError(
        absl::StrCat("the map has ", nodes.size(), " entries and the mesh ", vertices,
                     " vertices; the map needs a line per vertex, -1 -1 where a vertex has no cell"));
  }
  // Corners run from 0 to rows and from 0 to cols.
  const int rows = board.rows + 1, cols = board.cols + 1;
  std::vector<int> owners[] = {std::vector<int>(static_cast<size_t>(rows) * cols, -1),
                               std::vector<int>(static_cast<size_t>(rows) * cols, -1)};
  bool any = false;
  for (size_t v = 0; v < nodes.size(); ++v) {
    const auto [row, col, kind] = nodes[v];
    if (row == -1 && col == -1) continue;
    const bool corner = kind == NodeKind::kCorner;
    const std::string name = absl::StrCat(corner ? "corner (" : "cell (", row, ", ", col, ")");
    if (corner ? row < 0 || col < 0 || row >= rows || col >= cols : !board.Contains(row, col)) {
      return absl::InvalidArgumentError(absl::StrCat(
          "vertex ", v, ": ", name, " is not on the board of ", board.rows, " rows and ", board.cols,
          " columns (line ", v + 1, " of the map); is this the board that the garment was sewn from?"));
    }
    int& first = owners[corner][static_cast<size_t>(row) * cols + col];
    if (first >= 0) {
      return absl::InvalidArgumentError(absl::StrCat("vertex ", v, ": ", name, " belongs to vertex ", first,
                                                     " already (lines ", first + 1, " and ", v + 1,
                                                     " of the map); give one of the two -1 -1"));
    }
    first = static_cast<int>(v);
    any = any || !corner;
  }
  if (!any) return absl::InvalidArgumentError("the map gives no vertex a cell of the board");
  return absl::OkStatus();
}

std::string Template::ContentHash() const {
  weft::ContentHash hash;
  hash.Add("template").Add(board_hash);
  hash.AddInteger(rest.vertices_mm.size());
  for (const Eigen::Vector3d& v : rest.vertices_mm) hash.AddNumber(v.x()).AddNumber(v.y()).AddNumber(v.z());
  hash.AddInteger(rest.faces.size());
  for (const Face& face : rest.faces) {
    for (const int v : face) hash.AddInteger(static_cast<uint64_t>(v));
  }
  hash.AddInteger(node_of_vertex.size());
  for (const VertexNode& node : node_of_vertex) {
    hash.AddInteger(static_cast<uint64_t>(node.row)).AddInteger(static_cast<uint64_t>(node.col));
  }
  // A template without corners hashes as it did before there were any.
  for (size_t v = 0; v < node_of_vertex.size(); ++v) {
    if (node_of_vertex[v].IsCorner()) hash.Add("corner").AddInteger(v);
  }
  for (const GarmentSpan& one : garments)
    hash.Add("garment").Add(one.id).AddInteger(static_cast<uint64_t>(one.first_vertex));
  return hash.Hex();
}

absl::StatusOr<std::vector<VertexNode>> ParseVertexMap(std::string_view text, NodeKind kind,
                                                       const std::string& source_name) {
  const char* const what = kind == NodeKind::kCenter ? "cell" : "corner";
  std::vector<VertexNode> nodes;
  for (int line_number = 1; !text.empty(); ++line_number) {
    const size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    const auto bad = [&](const std::string& why) {
      return absl::InvalidArgumentError(absl::StrCat(source_name, ":", line_number, ": ", why));
    };
    VertexNode node{-1, -1, kind};
    if (!TakeInteger(&line, &node.row) || !TakeInteger(&line, &node.col) ||
        line.find_first_not_of(" \t\r") != std::string_view::npos) {
      return bad(absl::StrCat("expected `row col`, or `-1 -1` for a vertex without a ", what));
    }
    const bool none = node.row == -1 && node.col == -1;
    if (!none && (node.row < 0 || node.col < 0)) {
      return bad(absl::StrCat(what, " (", node.row, ", ", node.col, ") is negative; -1 -1 stands for none"));
    }
    nodes.push_back(none ? VertexNode{} : node);
  }
  if (nodes.empty()) return absl::InvalidArgumentError(absl::StrCat(source_name, ": the map is empty"));
  return nodes;
}

absl::Status JoinCorners(const std::vector<VertexNode>& corners, std::vector<VertexNode>* nodes) {
  if (corners.size() != nodes->size()) {
    return absl::InvalidArgumentError(absl::StrCat("the map of corners has ", corners.size(),
                                                   " lines and that of cells ", nodes->size(),
                                                   "; both need a line per vertex"));
  }
  for (size_t v = 0; v < corners.size(); ++v) {
    if (corners[v].row < 0) continue;
    if ((*nodes)[v].row >= 0) {
      return absl::InvalidArgumentError(
          absl::StrCat("vertex ", v, ": has cell (", (*nodes)[v].row, ", ", (*nodes)[v].col, ") and corner (",
                       corners[v].row, ", ", corners[v].col, "), line ", v + 1,
                       " of the maps; a vertex is one or the other, give -1 -1 in one of them"));
    }
    (*nodes)[v] = corners[v];
  }
  return absl::OkStatus();
}

absl::StatusOr<Template> ImportTemplate(std::string id, TriangleMesh mesh, std::vector<VertexNode> nodes,
                                        const Board& board) {
  if (id.empty()) return absl::InvalidArgumentError("the template's id is empty");
  WEFT_RETURN_IF_ERROR(board.Validate());
  WEFT_RETURN_IF_ERROR(CheckGarmentMesh(mesh));
  WEFT_RETURN_IF_ERROR(CheckVertexNodes(nodes, mesh.vertices_mm.size(), board));
  Template garment;
  garment.id = std::move(id);
  garment.rest = std::move(mesh);
  garment.board_hash = board.ContentHash();
  garment.node_of_vertex = std::move(nodes);
  return garment;
}

}  // namespace weft
