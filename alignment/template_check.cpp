#include "alignment/template_check.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <map>
#include <span>
#include <utility>

#include "absl/strings/str_cat.h"
#include "alignment/blank_vertices.h"
#include "alignment/face_sides.h"
#include "alignment/mapped_mesh.h"
#include "base/status_macros.h"

namespace weft {
namespace {

// All that a right template needs: one look at each face.
struct FaceScan {
  int64_t edges = 0, apart = 0;  // an edge counts once for each of its faces
  int64_t against = 0;           // faces that run against the print
  ShownSide shown = ShownSide::kUnknown;
};

FaceScan ScanFaces(std::span<const Face> faces, const Mapped& mapped) {
  FaceScan scan;
  EnclosedVolume volume(MiddleOf(mapped.vertices_mm, faces));
  for (const Face& face : faces) {
    const FaceOnBoard on_board = OnBoard(face, mapped);
    scan.edges += on_board.edges;
    scan.apart += on_board.apart;
    scan.against += on_board.sense < 0;
    volume.Add(mapped.PlaceOf(face[0]), mapped.PlaceOf(face[1]), mapped.PlaceOf(face[2]));
  }
  scan.shown = volume.Side();
  return scan;
}

struct ApartVertices {
  int a = -1, b = -1;          // of the first edge whose nodes are apart
  std::vector<int> strangers;  // vertices with such an edge, and no face to which the board gives a sense
};

ApartVertices FindApart(std::span<const Face> faces, const Mapped& mapped) {
  enum : uint8_t { kHasApart = 1, kAtHome = 2 };
  ApartVertices found;
  std::vector<uint8_t> marks(mapped.nodes.size(), 0);
  for (const Face& face : faces) {
    const FaceOnBoard on_board = OnBoard(face, mapped);
    for (int i = 0; i < 3; ++i) {
      if (on_board.edges == 3 && on_board.apart == 0) marks[static_cast<size_t>(face[i])] |= kAtHome;
      if (!on_board.is_apart[i]) continue;
      const int a = face[i], b = face[(i + 1) % 3];
      if (found.a < 0) found.a = a, found.b = b;
      marks[static_cast<size_t>(a)] |= kHasApart;
      marks[static_cast<size_t>(b)] |= kHasApart;
    }
  }
  for (size_t v = 0; v < marks.size(); ++v)
    if (marks[v] == kHasApart) found.strangers.push_back(static_cast<int>(v));
  return found;
}

// Pairs of cells beside each other on the board, both with vertices here, that no edge joins: the cloth would
// be cut there without losing a cell.
int64_t CountTorn(std::span<const Face> faces, const std::vector<VertexNode>& nodes) {
  std::vector<std::pair<int, int>> edges;
  std::map<std::pair<int, int>, int> vertex_of;
  for (const Face& face : faces) {
    for (int i = 0; i < 3; ++i) edges.push_back(std::minmax(face[i], face[(i + 1) % 3]));
    for (const int v : face) {
      const VertexNode& node = nodes[static_cast<size_t>(v)];
      if (node.IsCell()) vertex_of[{node.row, node.col}] = v;
    }
  }
  std::sort(edges.begin(), edges.end());
  int64_t torn = 0;
  for (const auto& [place, v] : vertex_of) {
    for (const auto& beside :
         {std::pair(place.first, place.second + 1), std::pair(place.first + 1, place.second)}) {
      const auto other = vertex_of.find(beside);
      if (other == vertex_of.end()) continue;
      torn +=
          !std::binary_search(edges.begin(), edges.end(), std::pair<int, int>(std::minmax(v, other->second)));
    }
  }
  return torn;
}

// How a map fits after all, where a simple change of its order makes it fit; else nothing.
std::string HintOfOrder(std::span<const Face> faces, const Mapped& mapped) {
  constexpr double kFits = 0.001;
  const auto n = static_cast<int64_t>(mapped.nodes.size());
  const auto fits = [&](const std::function<int64_t(int64_t)>& line_of) {
    std::vector<VertexNode> moved;
    for (int64_t v = 0; v < n; ++v)
      moved.push_back(mapped.nodes[static_cast<size_t>((line_of(v) % n + n) % n)]);
    const std::vector<NodeEdge> edges = SampleNodeEdges(mapped.vertices_mm, faces, moved);
    const double mm_per_cell = MedianLengthPerCell(edges);
    const auto apart = std::count_if(edges.begin(), edges.end(),
                                     [&](const NodeEdge& edge) { return IsApart(edge, mm_per_cell); });
    return static_cast<double>(apart) < kFits * static_cast<double>(edges.size());
  };
  if (fits([n](int64_t v) { return n - 1 - v; }))
    return " The map fits when the order of its lines is reversed.";
  for (const int shift : {1, -1, 2, -2}) {
    if (!fits([shift](int64_t v) { return v + shift; })) continue;
    return absl::StrCat(" The map fits when it is moved by ", std::abs(shift),
                        std::abs(shift) > 1 ? " lines" : " line", shift > 0 ? " up" : " down",
                        ": is a line missing, or one too many?");
  }
  return "";
}

absl::Status CheckOrderOf(std::span<const Face> faces, const Mapped& mapped, const FaceScan& scan) {
  constexpr int64_t kFewTorn = 3, kTornShare = 10;
  if (scan.apart == 0) return absl::OkStatus();
  const ApartVertices found = FindApart(faces, mapped);
  const std::string example =
      absl::StrCat(VertexText(found.a, mapped.nodes), " and ", VertexText(found.b, mapped.nodes),
                   ", an edge joins them, and they lie apart on the board; so do ", scan.apart, " of ",
                   scan.edges, " sides of faces. Mesh and map are not in the same order: ");
  // Some exchanged vertices, or all of them.
  if (!found.strangers.empty()) {
    constexpr size_t kShown = 4;
    std::string who;
    for (size_t i = 0; i < std::min(kShown, found.strangers.size()); ++i)
      absl::StrAppend(&who, i == 0 ? "" : ", ", found.strangers[i]);
    if (found.strangers.size() > kShown) absl::StrAppend(&who, " ...");
    return absl::InvalidArgumentError(absl::StrCat(example, found.strangers.size(),
                                                   " vertices have no neighbour from the board beside them (",
                                                   who, ").", HintOfOrder(faces, mapped), kOrderRemedy));
  }
  // Lines that begin elsewhere: whole strips at the ends of rows lie at the wrong side of their panel.
  const int64_t torn = CountTorn(faces, mapped.nodes);
  if (torn < std::max(kFewTorn, scan.apart / kTornShare)) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(example, torn,
                   " pairs of cells beside each other on the board are apart in the "
                   "mesh.",
                   HintOfOrder(faces, mapped), kOrderRemedy));
}

}  // namespace

absl::Status CheckTemplateMap(const Template& garment) {
  for (const GarmentFaces& one : GarmentsOf(garment)) {
    const Mapped mapped = MappedOf(garment.rest.vertices_mm, one.faces, garment.node_of_vertex);
    const FaceScan scan = ScanFaces(one.faces, mapped);
    absl::Status status = CheckOrderOf(one.faces, mapped, scan);
    if (status.ok()) status = CheckBlankVertices(one.faces, mapped);
    if (status.ok()) status = CheckPrintedSide(one.faces, mapped, scan.against > 0, scan.shown);
    if (!status.ok()) return OfGarment(one.id, status);
  }
  return absl::OkStatus();
}

absl::Status CheckVertexOrder(const Template& garment) {
  for (const GarmentFaces& one : GarmentsOf(garment)) {
    const Mapped mapped = MappedOf(garment.rest.vertices_mm, one.faces, garment.node_of_vertex);
    absl::Status status = CheckOrderOf(one.faces, mapped, ScanFaces(one.faces, mapped));
    if (status.ok()) status = CheckBlankVertices(one.faces, mapped);
    if (!status.ok()) return OfGarment(one.id, status);
  }
  return absl::OkStatus();
}

absl::StatusOr<TemplateOnBoard> PutOnBoard(const Board& board, FaceSideSaid said, bool any_scale,
                                           Template* garment) {
  WEFT_RETURN_IF_ERROR(CheckVertexOrder(*garment));
  WEFT_ASSIGN_OR_RETURN(const TurnedFaces turned,
                        ShowPrintedSide(garment->node_of_vertex, said, &garment->rest));
  WEFT_ASSIGN_OR_RETURN(TemplateSize size, CheckTemplateOnBoard(*garment, board, any_scale));
  return TemplateOnBoard{turned, std::move(size)};
}

}  // namespace weft
