#include "services/files/template_file.h"

#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "services/files/atomic_file.h"
#include "services/files/json_file.h"
#include "services/files/mesh_file.h"
#include "weft/v1/template.pb.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

absl::Status CheckFileName(const std::string& path, const char* field, const std::string& name) {
  if (!name.empty() && !fs::path(name).has_parent_path() && name != "." && name != "..")
    return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      path, ": the field ", field, " must name a file in the same folder, it is \"", name, "\""));
}

std::string CellsText(const std::vector<VertexCell>& cells) {
  std::string text;
  for (const VertexCell& cell : cells) absl::StrAppend(&text, cell.row, " ", cell.col, "\n");
  return text;
}

}  // namespace

absl::StatusOr<Template> ReadTemplate(const std::string& path) {
  std::error_code error;
  const std::string json = fs::is_directory(path, error) ? (fs::path(path) / "template.json").string() : path;
  v1::Template proto;
  if (absl::Status status = ReadJsonFile(json, proto); !status.ok()) return status;
  absl::Status status = CheckFileName(json, "mesh", proto.mesh());
  status.Update(CheckFileName(json, "cells", proto.cells()));
  if (!status.ok()) return status;
  const fs::path folder = fs::path(json).parent_path();

  absl::StatusOr<TriangleMesh> mesh = ReadMesh((folder / proto.mesh()).string());
  if (!mesh.ok()) return mesh.status();
  const std::string cells_path = (folder / proto.cells()).string();
  const absl::StatusOr<std::string> text = ReadWholeFile(cells_path);
  if (!text.ok()) return text.status();
  absl::StatusOr<std::vector<VertexCell>> cells = ParseVertexCells(*text, cells_path);
  if (!cells.ok()) return cells.status();
  if (cells->size() != mesh->vertices_mm.size()) {
    return absl::InvalidArgumentError(absl::StrCat(
        cells_path, ": has ", cells->size(), " lines, the mesh has ", mesh->vertices_mm.size(), " vertices"));
  }
  Template garment;
  garment.id = proto.id();
  garment.board_hash = proto.board_hash();
  garment.rest = *std::move(mesh);
  garment.cell_of_vertex = *std::move(cells);
  if (proto.has_hash() && proto.hash() != garment.ContentHash()) {
    return absl::InvalidArgumentError(absl::StrCat(json, ": the field hash says ", proto.hash(),
                                                   ", but mesh and cells hash to ", garment.ContentHash(),
                                                   "; import the template again"));
  }
  return garment;
}

absl::Status WriteTemplate(const std::string& folder, const Template& garment,
                           const std::string& provenance) {
  if (absl::Status status = CreateFolders(folder); !status.ok()) return status;
  const fs::path base(folder);
  if (absl::Status status = WriteMesh((base / "mesh.ply").string(), garment.rest); !status.ok())
    return status;
  if (absl::Status status =
          WriteFileAtomically((base / "cells.txt").string(), CellsText(garment.cell_of_vertex));
      !status.ok()) {
    return status;
  }
  v1::Template proto;
  if (!garment.id.empty()) proto.set_id(garment.id);
  proto.set_hash(garment.ContentHash());
  if (!provenance.empty()) proto.set_provenance(provenance);
  proto.set_board_hash(garment.board_hash);
  proto.set_mesh("mesh.ply");
  proto.set_cells("cells.txt");
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
