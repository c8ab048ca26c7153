#include "services/formats/files/template_file.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "alignment/mesh_texture.h"
#include "alignment/template_check.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/garment_file.h"
#include "services/formats/files/garment_parts_file.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/files/parts_message.h"
#include "services/formats/files/ply.h"
#include "services/formats/files/text_file.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kMostMeshBytes = uint64_t{512} << 20,
                   kMostCellsBytes = uint64_t{256} << 20;  // millions of vertices

absl::Status CheckFileName(const std::string& path, const char* field, const std::string& name) {
  if (!name.empty() && !fs::path(name).has_parent_path() && name != "." && name != "..")
    return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      path, ": the field ", field, " must name a file in the same folder, it is \"", name, "\""));
}

}  // namespace

void AddParts(const GarmentParts& parts, v1::Template& proto) {
  proto.set_cell_mm(parts.cell_mm);
  for (const TemplatePanel& panel : parts.panels) {
    v1::TemplatePanel* out = proto.add_panels();
    out->set_cells(panel.cells);
    out->set_first_row(panel.first_row);
    out->set_last_row(panel.last_row);
    out->set_first_col(panel.first_col);
    out->set_last_col(panel.last_col);
    out->set_texture_row(panel.texture_row);
    out->set_texture_col(panel.texture_col);
    out->set_quarter_turns(panel.quarter_turns);
  }
  for (const Seam& seam : parts.seams) {
    v1::TemplateSeam* out = proto.add_seams();
    out->set_panel_a(seam.panel_a);
    out->set_panel_b(seam.panel_b);
    out->set_length_mm(seam.length_mm);
    out->set_gap_mm(seam.gap_mm);
    out->set_max_gap_mm(seam.max_gap_mm);
    out->mutable_side_a()->Assign(seam.side_a.begin(), seam.side_a.end());
    out->mutable_side_b()->Assign(seam.side_b.begin(), seam.side_b.end());
    out->mutable_middle()->Assign(seam.middle.begin(), seam.middle.end());
  }
  for (const TemplateBorder& opening : parts.openings) {
    v1::TemplateOpening* out = proto.add_openings();
    out->set_length_mm(opening.length_mm);
    out->mutable_panels()->Assign(opening.panels.begin(), opening.panels.end());
    out->mutable_vertices()->Assign(opening.loop.begin(), opening.loop.end());
  }
  if (parts.expected_openings >= 0) proto.set_expected_openings(parts.expected_openings);
  proto.set_panel_faces(parts.panel_faces);
  proto.set_texture_side_mm(parts.texture_side_mm);
  proto.set_board_rows(parts.board_rows);
  proto.set_board_cols(parts.board_cols);
  proto.set_any_scale(parts.any_scale);
}

namespace {

GarmentParts PartsFromProto(const v1::Template& proto) {
  GarmentParts parts;
  parts.cell_mm = proto.cell_mm();
  for (const v1::TemplatePanel& panel : proto.panels()) {
    parts.panels.push_back({panel.cells(), panel.first_row(), panel.last_row(), panel.first_col(),
                            panel.last_col(), panel.texture_row(), panel.texture_col(),
                            panel.quarter_turns()});
  }
  for (const v1::TemplateSeam& seam : proto.seams()) {
    parts.seams.push_back({{seam.side_a().begin(), seam.side_a().end()},
                           {seam.side_b().begin(), seam.side_b().end()},
                           seam.panel_a(),
                           seam.panel_b(),
                           seam.length_mm(),
                           seam.gap_mm(),
                           seam.max_gap_mm(),
                           false,
                           {seam.middle().begin(), seam.middle().end()}});
  }
  for (const v1::TemplateOpening& opening : proto.openings()) {
    parts.openings.push_back({{opening.vertices().begin(), opening.vertices().end()},
                              opening.length_mm(),
                              {opening.panels().begin(), opening.panels().end()}});
  }
  if (proto.has_expected_openings()) parts.expected_openings = proto.expected_openings();
  parts.panel_faces = proto.panel_faces();
  parts.texture_side_mm = proto.texture_side_mm();
  parts.board_rows = proto.board_rows();
  parts.board_cols = proto.board_cols();
  parts.any_scale = proto.any_scale();
  return parts;
}

// The properties s and t of the vertices; empty where they have none.
std::vector<Eigen::Vector2d> TextureFromPly(const Ply& ply) {
  const PlyElement* vertex = ply.Find("vertex");
  const PlyProperty* s = vertex ? vertex->Find("s") : nullptr;
  const PlyProperty* t = vertex ? vertex->Find("t") : nullptr;
  if (!s || !t || s->is_list || t->is_list) return {};
  std::vector<Eigen::Vector2d> texture;
  for (size_t row = 0; row < vertex->rows; ++row) texture.emplace_back(s->values[row], t->values[row]);
  return texture;
}

// The map of the vertices that are such nodes.
std::string MapText(const std::vector<VertexNode>& nodes, NodeKind kind) {
  std::string text;
  for (const VertexNode& node : nodes) {
    const VertexNode shown = node.kind == kind ? node : VertexNode{};
    absl::StrAppend(&text, shown.row, " ", shown.col, "\n");
  }
  return text;
}

absl::StatusOr<std::vector<VertexNode>> ReadMap(const std::string& path, NodeKind kind, size_t vertices) {
  WEFT_ASSIGN_OR_RETURN(const std::string text, ReadTextFile(path, kMostCellsBytes));
  absl::StatusOr<std::vector<VertexNode>> nodes = ParseVertexMap(text, kind, path);
  if (nodes.ok() && nodes->size() != vertices) {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": has ", nodes->size(), " lines, the mesh has ", vertices, " vertices"));
  }
  return nodes;
}

std::string JsonPath(const std::string& path) {
  std::error_code error;
  return fs::is_directory(path, error) ? (fs::path(path) / "template.json").string() : path;
}

absl::StatusOr<v1::Template> ReadProto(const std::string& json) {
  if (IsMeshName(json))
    return absl::InvalidArgumentError(absl::StrCat(
        json,
        ": is a mesh, and this needs a template, which knows the board cell of each vertex; `weft template "
        "import` makes one of a mesh with a map of cells"));
  v1::Template proto;
  WEFT_RETURN_IF_ERROR(ReadJsonFile(json, proto, kInputJson));
  absl::Status status = CheckFileName(json, "mesh", proto.mesh());
  status.Update(CheckFileName(json, "cells", proto.cells()));
  if (!proto.corners().empty()) status.Update(CheckFileName(json, "corners", proto.corners()));
  if (!status.ok()) return status;
  return proto;
}

}  // namespace

absl::StatusOr<GarmentParts> ReadGarmentParts(const std::string& path) {
  const std::string json = JsonPath(path);
  WEFT_ASSIGN_OR_RETURN(const v1::Template proto, ReadProto(json));
  const std::string mesh_path = (fs::path(json).parent_path() / proto.mesh()).string();
  WEFT_ASSIGN_OR_RETURN(const Ply ply, ReadPly(mesh_path, kMostMeshBytes));
  WEFT_ASSIGN_OR_RETURN(const TriangleMesh mesh, MeshFromPly(ply, mesh_path));
  GarmentParts parts = PartsFromProto(proto);
  if (parts.texture_side_mm > 0) {
    parts.texture_mm = TextureFromPly(ply);
    for (Eigen::Vector2d& place : parts.texture_mm) place *= parts.texture_side_mm;
  }
  if (absl::Status status = CheckGarmentParts(parts, mesh); !status.ok()) {
    return absl::Status(status.code(), absl::StrCat(json, ": ", status.message()));
  }
  return parts;
}

absl::StatusOr<Template> ReadTemplate(const std::string& path) {
  const std::string json = JsonPath(path);
  WEFT_ASSIGN_OR_RETURN(const v1::Template read, ReadProto(json));
  const v1::Template& proto = read;
  const fs::path folder = fs::path(json).parent_path();

  WEFT_ASSIGN_OR_RETURN(TriangleMesh mesh, ReadMesh((folder / proto.mesh()).string(), kMostMeshBytes));
  const size_t vertices = mesh.vertices_mm.size();
  WEFT_ASSIGN_OR_RETURN(std::vector<VertexNode> nodes,
                        ReadMap((folder / proto.cells()).string(), NodeKind::kCenter, vertices));
  if (!proto.corners().empty()) {
    WEFT_ASSIGN_OR_RETURN(const std::vector<VertexNode> corners,
                          ReadMap((folder / proto.corners()).string(), NodeKind::kCorner, vertices));
    if (absl::Status status = JoinCorners(corners, &nodes); !status.ok()) {
      return absl::Status(status.code(), absl::StrCat(json, ": ", status.message()));
    }
  }
  Template garment;
  garment.id = proto.id();
  garment.board_hash = proto.board_hash();
  garment.rest = std::move(mesh);
  garment.node_of_vertex = std::move(nodes);
  for (const v1::TemplateGarment& one : proto.garments())
    garment.garments.push_back({one.id(), one.first_vertex(), one.vertices(), one.first_face(), one.faces()});
  if (absl::Status status = CheckGarmentSpans(garment); !status.ok())
    return absl::InvalidArgumentError(absl::StrCat(json, ": ", status.message()));
  if (proto.has_hash() && proto.hash() != garment.ContentHash()) {
    return absl::InvalidArgumentError(absl::StrCat(json, ": the field hash says ", proto.hash(),
                                                   ", but mesh and maps hash to ", garment.ContentHash(),
                                                   "; import the template again"));
  }
  if (absl::Status status = CheckTemplateMap(garment); !status.ok())
    return absl::Status(status.code(), absl::StrCat(json, ": ", status.message()));
  return garment;
}

absl::StatusOr<Template> ReadTemplateFor(const Board& board, const std::string& path,
                                         std::vector<std::string>* notes) {
  absl::StatusOr<Template> garment = ReadTemplate(path);
  if (!garment.ok()) return garment;
  WEFT_RETURN_IF_ERROR(CheckTemplateFitsBoard(*garment, board));
  WEFT_ASSIGN_OR_RETURN(const v1::Template proto, ReadProto(JsonPath(path)));
  const absl::StatusOr<TemplateSize> size = CheckTemplateOnBoard(*garment, board, proto.any_scale());
  if (!size.ok())
    return absl::Status(size.status().code(), absl::StrCat(path, ": ", size.status().message()));
  for (const std::string& note : size->off) notes->push_back(absl::StrCat("template ", path, ": ", note));
  return garment;
}

absl::Status WriteTemplate(const std::string& folder, const Template& garment,
                           const std::string& provenance) {
  return WriteTemplateWithParts(folder, garment, {}, provenance);
}

absl::Status WriteTemplateWithParts(const std::string& folder, const Template& garment,
                                    const GarmentParts& parts, const std::string& provenance) {
  WEFT_RETURN_IF_ERROR(CreateFolders(folder));
  const fs::path base(folder);
  WEFT_RETURN_IF_ERROR(WriteMesh((base / "mesh.ply").string(), garment.rest, TextureOf(garment, parts)));
  WEFT_RETURN_IF_ERROR(
      WriteFileAtomically((base / "cells.txt").string(), MapText(garment.node_of_vertex, NodeKind::kCenter)));
  const bool corners = std::any_of(garment.node_of_vertex.begin(), garment.node_of_vertex.end(),
                                   [](const VertexNode& node) { return node.IsCorner(); });
  const std::string corners_path = (base / "corners.txt").string();
  std::error_code error;
  if (corners) {
    WEFT_RETURN_IF_ERROR(
        WriteFileAtomically(corners_path, MapText(garment.node_of_vertex, NodeKind::kCorner)));
  } else {
    fs::remove(corners_path, error);  // of another template that lay here
  }
  v1::Template proto;
  if (!garment.id.empty()) proto.set_id(garment.id);
  proto.set_hash(garment.ContentHash());
  if (!provenance.empty()) proto.set_provenance(provenance);
  proto.set_board_hash(garment.board_hash);
  proto.set_mesh("mesh.ply");
  proto.set_cells("cells.txt");
  if (corners) proto.set_corners("corners.txt");
  AddParts(parts, proto);
  for (const GarmentSpan& one : garment.garments) {
    v1::TemplateGarment* out = proto.add_garments();
    out->set_id(one.id);
    out->set_first_vertex(one.first_vertex);
    out->set_vertices(one.vertices);
    out->set_first_face(one.first_face);
    out->set_faces(one.faces);
  }
  return WriteJsonFile((base / "template.json").string(), proto, JsonZeros::kOmitted);
}

absl::Status CheckTemplateFitsBoard(const Template& garment, const Board& board) {
  const std::string hash = board.ContentHash();
  if (garment.board_hash == hash) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("the template ", garment.id,
                                                 " was sewn from the board with hash ", garment.board_hash,
                                                 ", the board given has hash ", hash));
}

}  // namespace weft
