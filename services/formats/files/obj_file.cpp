#include "services/formats/files/obj_file.h"

#include <filesystem>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/str_split.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/mesh_file.h"

#ifdef WEFT_HAS_OBJ
// assimp, which reads BVH, gives each corner of a face a vertex of its own: the order of the `v` lines, which
// the map of cells follows, would be lost.
#define TINYOBJLOADER_IMPLEMENTATION
#define TINYOBJLOADER_USE_DOUBLE
#include <tiny_obj_loader.h>
#endif

namespace weft {

#ifdef WEFT_HAS_OBJ
namespace {

// The text with all statements emptied that no mesh needs: tinyobj converts numbers of some, such as skin
// weights, without a check. Line numbers stay.
std::string StatementsOfMesh(std::string_view text) {
  const std::string lines = absl::StrReplaceAll({text.data(), text.size()}, {{"\r\n", "\n"}, {"\r", "\n"}});
  std::string kept;
  kept.reserve(lines.size() + 1);
  for (const absl::string_view line : absl::StrSplit(lines, '\n')) {
    const absl::string_view statement = absl::StripLeadingAsciiWhitespace(line);
    const absl::string_view keyword = statement.substr(0, statement.find_first_of(" \t"));
    if (keyword == "v" || keyword == "vt" || keyword == "vn" || keyword == "f") absl::StrAppend(&kept, line);
    kept += '\n';
  }
  return kept;
}

absl::Status AddFaces(const tinyobj::mesh_t& from, const std::string& source_name, TriangleMesh* mesh) {
  size_t at = 0;
  for (const auto corners : from.num_face_vertices) {
    const size_t face = mesh->faces.size();
    if (corners != 3) {
      return absl::InvalidArgumentError(absl::StrCat(source_name, ": face ", face, " has ", int{corners},
                                                     " corners; triangulate the mesh first"));
    }
    Face indices{};
    for (int& index : indices) {
      index = from.indices[at++].vertex_index;
      if (index < 0 || static_cast<size_t>(index) >= mesh->vertices_mm.size()) {
        return absl::InvalidArgumentError(absl::StrCat(source_name, ": face ", face, " names vertex ",
                                                       index + 1, ", the file has ", mesh->vertices_mm.size(),
                                                       " vertices"));
      }
    }
    mesh->faces.push_back(indices);
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<TriangleMesh> MeshFromObj(std::string_view text, const std::string& source_name) {
  tinyobj::ObjReaderConfig config;
  config.triangulate = false;
  config.vertex_color = false;
  tinyobj::ObjReader reader;
  if (!reader.ParseFromString(StatementsOfMesh(text), "", config)) {
    const absl::string_view why = absl::StripAsciiWhitespace(reader.Error());
    return absl::InvalidArgumentError(
        absl::StrCat(source_name, ": is no OBJ that can be read", why.empty() ? "" : ": ", why));
  }
  TriangleMesh mesh;
  const std::vector<double>& at = reader.GetAttrib().vertices;
  for (size_t i = 0; i + 2 < at.size(); i += 3) {
    mesh.vertices_mm.emplace_back(at[i], at[i + 1], at[i + 2]);
    if (!mesh.vertices_mm.back().allFinite())
      return absl::InvalidArgumentError(absl::StrCat(source_name, ": vertex ", i / 3 + 1, " is not finite"));
  }
  for (const tinyobj::shape_t& shape : reader.GetShapes())
    WEFT_RETURN_IF_ERROR(AddFaces(shape.mesh, source_name, &mesh));
  if (mesh.vertices_mm.empty() || mesh.faces.empty())
    return absl::InvalidArgumentError(absl::StrCat(source_name, ": has no vertices or no faces"));
  return mesh;
}
#else
absl::StatusOr<TriangleMesh> MeshFromObj(std::string_view, const std::string& source_name) {
  return absl::UnimplementedError(absl::StrCat(
      source_name,
      ": this build of Weft reads no OBJ: install libtinyobjloader-dev and build again, or give PLY"));
}
#endif

absl::StatusOr<TriangleMesh> ReadForeignMesh(const std::string& path) {
  if (absl::AsciiStrToLower(std::filesystem::path(path).extension().string()) != ".obj")
    return ReadMesh(path);
  WEFT_ASSIGN_OR_RETURN(const std::string text, ReadWholeFile(path));
  return MeshFromObj(text, path);
}

}  // namespace weft
