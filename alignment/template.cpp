#include "alignment/template.h"

#include <algorithm>
#include <charconv>
#include <set>
#include <tuple>

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

absl::Status CheckFaceIndices(const TriangleMesh& mesh) {
  const int vertices = static_cast<int>(mesh.vertices_mm.size());
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    const Face& face = mesh.faces[f];
    for (const int v : face) {
      if (v < 0 || v >= vertices) {
        return absl::InvalidArgumentError(
            absl::StrCat("face ", f, ": vertex ", v, " is not one of the mesh's ", vertices));
      }
    }
    if (face[0] == face[1] || face[1] == face[2] || face[2] == face[0]) {
      return absl::InvalidArgumentError(
          absl::StrCat("face ", f, ": a vertex occurs twice (", face[0], ", ", face[1], ", ", face[2], ")"));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckEdges(const TriangleMesh& mesh) {
  struct Side {
    int low, high, face;
  };
  std::vector<Side> sides;
  sides.reserve(3 * mesh.faces.size());
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    for (int i = 0; i < 3; ++i) {
      const int a = mesh.faces[f][i], b = mesh.faces[f][(i + 1) % 3];
      sides.push_back({std::min(a, b), std::max(a, b), static_cast<int>(f)});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::tie(a.low, a.high, a.face) < std::tie(b.low, b.high, b.face);
  });
  // The first face, in the order of the mesh, that is one too many at an edge.
  const Side* first = nullptr;
  for (size_t i = 2; i < sides.size(); ++i) {
    const bool third = sides[i].low == sides[i - 2].low && sides[i].high == sides[i - 2].high;
    if (third && (first == nullptr || sides[i].face < first->face)) first = &sides[i];
  }
  if (first == nullptr) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("face ", first->face, ": its edge between vertices ",
                                                 first->low, " and ", first->high,
                                                 " has two faces already; cloth has at most two at an edge"));
}

}  // namespace

absl::Status CheckTemplateMesh(const TriangleMesh& mesh) {
  if (mesh.vertices_mm.empty()) return absl::InvalidArgumentError("the mesh has no vertices");
  if (mesh.faces.empty()) return absl::InvalidArgumentError("the mesh has no faces");
  for (size_t v = 0; v < mesh.vertices_mm.size(); ++v) {
    if (!mesh.vertices_mm[v].allFinite()) {
      return absl::InvalidArgumentError(absl::StrCat("vertex ", v, ": position is not finite"));
    }
  }
  WEFT_RETURN_IF_ERROR(CheckFaceIndices(mesh));
  return CheckEdges(mesh);
}

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
  for (const TemplateGarment& one : garments)
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

absl::Status CheckTemplateGarments(const Template& garment) {
  const auto bad = [&](size_t i, const std::string& why) {
    return absl::InvalidArgumentError(
        absl::StrCat("garments[", i, "] (", garment.garments[i].id, "): ", why));
  };
  const int vertices = static_cast<int>(garment.rest.vertices_mm.size());
  const int faces = static_cast<int>(garment.rest.faces.size());
  std::set<std::string_view> ids;
  int vertex = 0, face = 0;
  for (size_t i = 0; i < garment.garments.size(); ++i) {
    const TemplateGarment& one = garment.garments[i];
    if (one.id.empty()) return bad(i, "has no id");
    if (!ids.insert(one.id).second) return bad(i, "another garment has this id, too");
    if (one.vertices <= 0 || one.faces <= 0 || one.vertices > vertices - vertex || one.faces > faces - face)
      return bad(i, absl::StrCat("has ", one.vertices, " vertices and ", one.faces, " faces, the mesh has ",
                                 vertices - vertex, " and ", faces - face, " more"));
    if (one.first_vertex != vertex || one.first_face != face)
      return bad(i, absl::StrCat("begins at vertex ", one.first_vertex, " and face ", one.first_face,
                                 ", expected ", vertex, " and ", face));
    vertex += one.vertices, face += one.faces;
    for (int f = one.first_face; f < face; ++f)
      for (const int v : garment.rest.faces[static_cast<size_t>(f)])
        if (v < one.first_vertex || v >= vertex)
          return bad(i, absl::StrCat("its face ", f, " has vertex ", v, " of another garment"));
  }
  if (vertex == 0) return absl::OkStatus();
  if (vertex != vertices || face != faces)
    return absl::InvalidArgumentError(absl::StrCat("garments: end at vertex ", vertex, " and face ", face,
                                                   ", the mesh has ", vertices, " and ", faces));
  return absl::OkStatus();
}

absl::StatusOr<Template> ImportTemplate(std::string id, TriangleMesh mesh, std::vector<VertexNode> nodes,
                                        const Board& board) {
  if (id.empty()) return absl::InvalidArgumentError("the template's id is empty");
  WEFT_RETURN_IF_ERROR(board.Validate());
  WEFT_RETURN_IF_ERROR(CheckTemplateMesh(mesh));
  WEFT_RETURN_IF_ERROR(CheckVertexNodes(nodes, mesh.vertices_mm.size(), board));
  return Template{std::move(id), board.ContentHash(), std::move(mesh), std::move(nodes), {}};
}

}  // namespace weft
