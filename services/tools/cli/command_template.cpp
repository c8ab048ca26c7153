// weft template: garments, the mesh at rest and what of the board each of its vertices is.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <numeric>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "alignment/mesh_graph.h"
#include "alignment/template_check.h"
#include "base/length_unit.h"
#include "base/named_status.h"
#include "services/formats/files/board_file.h"
#include "services/formats/files/garment_parts_file.h"
#include "services/formats/files/obj_file.h"
#include "services/formats/files/text_file.h"
#include "services/ground/process/exit_status.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/output_guard.h"
#include "services/tools/cli/template_summary.h"

namespace weft {
namespace {

struct TemplateImportOptions {
  std::string mesh;
  std::string cells;
  std::string corners;  // empty: no vertex is one
  std::string board;
  std::string out;
  std::string id;
  int openings = -1;
  std::string unit = "mm";
  bool allow_scale = false;
  bool turn_faces = false;
  OutputGuard guard;
};

// Closed runs of edges that have one face. Where several meet at a vertex they count as one.
int CountBoundaryLoops(const TriangleMesh& mesh) {
  std::vector<std::pair<int, int>> edges;
  edges.reserve(3 * mesh.faces.size());
  for (const Face& face : mesh.faces) {
    for (int i = 0; i < 3; ++i) edges.push_back(std::minmax({face[i], face[(i + 1) % 3]}));
  }
  std::ranges::sort(edges);
  std::vector<int> parent(mesh.vertices_mm.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  std::vector<bool> on_boundary(mesh.vertices_mm.size(), false);
  for (size_t i = 0, next = 0; i < edges.size(); i = next) {
    while (next < edges.size() && edges[next] == edges[i]) ++next;
    if (next - i != 1) continue;
    const auto [a, b] = edges[i];
    on_boundary[a] = on_boundary[b] = true;
    parent[root(a)] = root(b);
  }
  int loops = 0;
  for (size_t v = 0; v < parent.size(); ++v) loops += on_boundary[v] && parent[v] == static_cast<int>(v);
  return loops;
}

void PrintSummary(const TemplateImportOptions& options, const Template& garment) {
  const size_t vertices = garment.node_of_vertex.size();
  const auto with_cell = static_cast<size_t>(
      std::ranges::count_if(garment.node_of_vertex, [](const VertexNode& node) { return node.IsCell(); }));
  const auto on_corner = static_cast<size_t>(
      std::ranges::count_if(garment.node_of_vertex, [](const VertexNode& node) { return node.IsCorner(); }));
  std::printf(
      "%s/template.json: %zu vertices, %zu faces, %zu vertices with a cell (%zu without), %s%d component(s), "
      "%d boundary loop(s), hash %s\n",
      options.out.c_str(), vertices, garment.rest.faces.size(), with_cell, vertices - with_cell,
      on_corner > 0 ? absl::StrCat(on_corner, " on a corner, ").c_str() : "",
      BuildMeshGraph(garment.rest).components, CountBoundaryLoops(garment.rest),
      garment.ContentHash().c_str());
}

std::string MapNames(const TemplateImportOptions& options) {
  return options.corners.empty() ? options.cells : absl::StrCat(options.cells, " and ", options.corners);
}

absl::StatusOr<std::vector<VertexNode>> ReadMaps(const TemplateImportOptions& options) {
  WEFT_ASSIGN_OR_RETURN(const std::string text, ReadTextFile(options.cells));
  absl::StatusOr<std::vector<VertexNode>> nodes = ParseVertexMap(text, NodeKind::kCenter, options.cells);
  if (!nodes.ok() || options.corners.empty()) return nodes;
  WEFT_ASSIGN_OR_RETURN(const std::string corners_text, ReadTextFile(options.corners));
  WEFT_ASSIGN_OR_RETURN(const std::vector<VertexNode> corners,
                        ParseVertexMap(corners_text, NodeKind::kCorner, options.corners));
  WEFT_RETURN_IF_ERROR(Naming(MapNames(options), JoinCorners(corners, &*nodes)));
  return nodes;
}

absl::StatusOr<TriangleMesh> ReadMeshInMm(const TemplateImportOptions& options) {
  WEFT_ASSIGN_OR_RETURN(TriangleMesh mesh, ReadForeignMesh(options.mesh));
  for (Eigen::Vector3d& v : mesh.vertices_mm) v *= LengthUnitNamed(options.unit).value().mm;
  return mesh;
}

// What of mesh and map deserves a word; the faces of `garment` show the printed side afterwards.
absl::StatusOr<std::vector<std::string>> CheckOnBoard(const TemplateImportOptions& options,
                                                      const Board& board, Template* garment) {
  WEFT_ASSIGN_OR_RETURN(const TemplateOnBoard on_board,
                        PutOnBoard(board, options.turn_faces ? FaceSideSaid::kInside : FaceSideSaid::kNothing,
                                   options.allow_scale, garment));
  std::vector<std::string> notes = on_board.size.off;
  notes.insert(notes.end(), on_board.size.unchecked.begin(), on_board.size.unchecked.end());
  if (on_board.turned.faces > 0)
    notes.push_back(
        absl::StrCat(on_board.turned.faces, " of ", garment->rest.faces.size(),
                     " faces showed the inside of the cloth and were turned to the printed side"));
  return notes;
}

absl::Status ImportTemplateFiles(const TemplateImportOptions& options) {
  WEFT_ASSIGN_OR_RETURN(const Board board, ReadBoard(options.board));
  WEFT_ASSIGN_OR_RETURN(TriangleMesh mesh, ReadMeshInMm(options));
  WEFT_ASSIGN_OR_RETURN(std::vector<VertexNode> nodes, ReadMaps(options));
  absl::Status status = Naming(options.mesh, CheckGarmentMesh(mesh));
  status.Update(Naming(absl::StrCat(MapNames(options), " with ", options.mesh),
                       CheckVertexNodes(nodes, mesh.vertices_mm.size(), board)));
  if (!status.ok()) return status;
  WEFT_ASSIGN_OR_RETURN(Template garment,
                        ImportTemplate(options.id.empty() ? TemplateIdOf(options.out) : options.id,
                                       std::move(mesh), std::move(nodes), board));
  const absl::StatusOr<std::vector<std::string>> notes = CheckOnBoard(options, board, &garment);
  WEFT_RETURN_IF_ERROR(Naming(absl::StrCat(MapNames(options), " with ", options.mesh), notes.status()));
  GarmentParts parts;
  parts.board_rows = board.rows, parts.board_cols = board.cols;
  parts.any_scale = options.allow_scale;
  if (options.openings >= 0) {
    const absl::StatusOr<v1::TemplateSummary> summary = SummarizeTemplate(garment, {});
    status = Naming(options.mesh, summary.status());
    if (status.ok()) status = Naming(options.mesh, CheckOpeningCount(*summary, options.openings));
    if (!status.ok()) return status;
    parts.expected_openings = options.openings;
  }
  const auto name_of = [](const std::string& path) {
    return std::filesystem::path(path).filename().string();
  };
  WEFT_RETURN_IF_ERROR(MayWriteTemplate(options.out, garment, options.guard));
  WEFT_RETURN_IF_ERROR(WriteTemplateWithParts(
      options.out, garment, parts,
      absl::StrCat("imported from ", name_of(options.mesh), " and ", name_of(options.cells))));
  for (const std::string& note : *notes) PrintWarning(absl::StrCat(options.mesh, ": ", note));
  PrintSummary(options, garment);
  return absl::OkStatus();
}

void AddCheckOptions(CLI::App& command, TemplateImportOptions& options) {
  AddOption(command, "--unit UNIT", options.unit, "Unit of the mesh's coordinates", OneLengthUnit());
  command.add_flag("--allow-scale", options.allow_scale,
                   "Take a mesh whose edges are more than 5 % longer or shorter than on the print");
  command.add_flag("--turn-faces", options.turn_faces,
                   "All faces of a sheet show its inside: turn them. Those of garments that enclose "
                   "something are turned without it");
}

}  // namespace

void AddTemplateCommand(CLI::App& app, CommandLine& line) {
  CLI::App* garment =
      AddGroup(app, "template", "Make a garment's template: its mesh and the board cell of each vertex");
  AddTemplateBuildCommand(*garment, line);
  AddTemplateCheckCommand(*garment, line);
  AddTemplateJoinCommand(*garment, line);
  const auto [command, options] = AddCommand<TemplateImportOptions>(
      *garment, line, ImportTemplateFiles, "import",
      "Check that a mesh, a vertex-to-cell map and a board belong together, and write them as a template: "
      "DIR/template.json, DIR/mesh.ply and DIR/cells.txt (and DIR/corners.txt). Nothing is written when they "
      "do not fit: vertices in another order than the map, a mirrored mesh or map, another size than the "
      "print.",
      "  weft template import --mesh shirt.ply --cells vertex_to_cell.txt --board board.png --out shirt");
  AddRequired(*command, "--mesh FILE", options->mesh,
              "The garment at rest: triangles, PLY or OBJ, vertices in the order of the map");
  AddRequired(*command, "--cells FILE", options->cells,
              "Text with a line `row col` per vertex of the mesh, `-1 -1` for a vertex without a cell");
  AddOption(*command, "--corners FILE", options->corners,
            "Text like that of --cells, for vertices that are corners between cells: corner `row col` is the "
            "upper left one of that cell. Without it only centres of cells are vertices");
  AddRequired(*command, "--board BOARD", options->board, "board.json or board.png of the cloth");
  AddRequired(*command, "--out DIR", options->out, "Folder to write to");
  options->guard.AddTo(*command);
  AddOption(*command, "--id NAME", options->id, "Name of the template; by default that of the folder");
  AddOption(*command, "--openings N", options->openings,
            "Openings that the garment has, e.g. 4 for a T-shirt: a mesh with others, or that is no clean "
            "surface, is refused",
            CLI::Range(-1, 100));
  AddCheckOptions(*command, *options);
}

}  // namespace weft
