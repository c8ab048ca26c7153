#include "services/formats/files/obj_file.h"

#include <cmath>
#include <filesystem>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
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

constexpr size_t kMostCorners = 255;  // of a face, as the reader counts them

// tinyobj takes what is no number for 0. Further values of a line, such as colours, are not used.
absl::Status CheckNumbers(absl::string_view statement, size_t least, size_t most, int line,
                          const std::string& source_name) {
  const std::vector<absl::string_view> words =
      absl::StrSplit(statement, absl::ByAnyChar(" \t"), absl::SkipEmpty());
  for (size_t i = 1; i <= most; ++i) {
    double value = 0;
    if (i >= words.size() && i > least) return absl::OkStatus();
    if (i < words.size() && absl::SimpleAtod(words[i], &value) && std::isfinite(value)) continue;
    return absl::InvalidArgumentError(
        absl::StrCat(source_name, ":", line, ": ", words[0], " needs ", least == most ? "" : "up to ", most,
                     " finite numbers, it has \"", i < words.size() ? words[i] : "too few", "\"",
                     "; export the mesh again"));
  }
  return absl::OkStatus();
}

// The text with all statements emptied that no mesh needs: tinyobj converts numbers of some, such as skin
// weights, without a check. A backslash at its end continues a line. Line numbers stay.
absl::StatusOr<std::string> StatementsOfMesh(std::string_view text, const std::string& source_name) {
  std::string lines = absl::StrReplaceAll({text.data(), text.size()}, {{"\r\n", "\n"}, {"\r", "\n"}});
  lines += '\n';
  std::string kept, line;
  kept.reserve(lines.size() + 1);
  int line_number = 1, continued = 0;
  for (const absl::string_view part : absl::StrSplit(lines, '\n')) {
    absl::StrAppend(&line, part);
    const absl::string_view statement = absl::StripLeadingAsciiWhitespace(line);
    const absl::string_view keyword = statement.substr(0, statement.find_first_of(" \t\\"));
    const bool is_kept = keyword == "v" || keyword == "vt" || keyword == "vn" || keyword == "f";
    if (is_kept && line.back() == '\\') {
      line.back() = ' ', ++continued;
      continue;
    }
    if (keyword == "v") WEFT_RETURN_IF_ERROR(CheckNumbers(statement, 3, 3, line_number, source_name));
    if (keyword == "vt") WEFT_RETURN_IF_ERROR(CheckNumbers(statement, 1, 2, line_number, source_name));
    if (is_kept) kept += line;
    kept.append(static_cast<size_t>(continued) + 1, '\n');
    line_number += continued + 1, continued = 0, line.clear();
  }
  return kept;
}

absl::Status AddPolygons(const tinyobj::mesh_t& from, const std::string& source_name, ObjMesh* mesh) {
  size_t at = 0;
  for (const auto corners : from.num_face_vertices) {
    const size_t face = mesh->polygons.size();
    std::vector<ObjCorner>& polygon = mesh->polygons.emplace_back();
    if (at + corners > from.indices.size()) break;
    for (size_t k = 0; k < corners; ++k, ++at) {
      const ObjCorner corner = {from.indices[at].vertex_index, from.indices[at].texcoord_index};
      const auto outside = [&](int index, size_t count) {
        return index < 0 || static_cast<size_t>(index) >= count;
      };
      if (outside(corner.vertex, mesh->vertices.size()))
        return absl::InvalidArgumentError(absl::StrCat(source_name, ": face ", face + 1, " names vertex ",
                                                       corner.vertex + 1, ", the file has ",
                                                       mesh->vertices.size(), " vertices"));
      if (corner.texture != -1 && outside(corner.texture, mesh->texture.size()))
        return absl::InvalidArgumentError(
            absl::StrCat(source_name, ": face ", face + 1, " names texture coordinate ", corner.texture + 1,
                         ", the file has ", mesh->texture.size(), " vt lines; export the mesh again"));
      polygon.push_back(corner);
    }
  }
  if (at == from.indices.size()) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(source_name, ": a face has more than ", kMostCorners,
                                                 " corners; triangulate the mesh first"));
}

}  // namespace

absl::StatusOr<ObjMesh> ParseObj(std::string_view text, const std::string& source_name) {
  WEFT_ASSIGN_OR_RETURN(const std::string statements, StatementsOfMesh(text, source_name));
  tinyobj::ObjReaderConfig config;
  config.triangulate = false;
  config.vertex_color = false;
  tinyobj::ObjReader reader;
  if (!reader.ParseFromString(statements, "", config)) {
    const absl::string_view why = absl::StripAsciiWhitespace(reader.Error());
    return absl::InvalidArgumentError(
        absl::StrCat(source_name, ": is no OBJ that can be read", why.empty() ? "" : ": ", why));
  }
  ObjMesh mesh;
  const std::vector<double>& at = reader.GetAttrib().vertices;
  for (size_t i = 0; i + 2 < at.size(); i += 3) mesh.vertices.emplace_back(at[i], at[i + 1], at[i + 2]);
  const std::vector<double>& uv = reader.GetAttrib().texcoords;
  for (size_t i = 0; i + 1 < uv.size(); i += 2) mesh.texture.emplace_back(uv[i], uv[i + 1]);
  for (const tinyobj::shape_t& shape : reader.GetShapes())
    WEFT_RETURN_IF_ERROR(AddPolygons(shape.mesh, source_name, &mesh));
  if (absl::StrContains(reader.Warning(), "Degenerated"))
    return absl::InvalidArgumentError(absl::StrCat(
        source_name, ": a face has fewer than three corners; delete it, or export the mesh again"));
  if (mesh.vertices.empty() || mesh.polygons.empty())
    return absl::InvalidArgumentError(absl::StrCat(source_name, ": has no vertices or no faces"));
  return mesh;
}
#else
absl::StatusOr<ObjMesh> ParseObj(std::string_view, const std::string& source_name) {
  return absl::UnimplementedError(absl::StrCat(
      source_name,
      ": this build of Weft reads no OBJ: install libtinyobjloader-dev and build again, or give PLY"));
}
#endif

absl::StatusOr<TriangleMesh> MeshFromObj(std::string_view text, const std::string& source_name) {
  WEFT_ASSIGN_OR_RETURN(ObjMesh read, ParseObj(text, source_name));
  TriangleMesh mesh;
  mesh.vertices_mm = std::move(read.vertices);
  for (const std::vector<ObjCorner>& polygon : read.polygons) {
    if (polygon.size() != 3)
      return absl::InvalidArgumentError(absl::StrCat(source_name, ": face ", mesh.faces.size() + 1, " has ",
                                                     polygon.size(), " corners; triangulate the mesh first"));
    mesh.faces.push_back({polygon[0].vertex, polygon[1].vertex, polygon[2].vertex});
  }
  return mesh;
}

bool IsObjName(const std::string& path) {
  return absl::AsciiStrToLower(std::filesystem::path(path).extension().string()) == ".obj";
}

absl::StatusOr<TriangleMesh> ReadForeignMesh(const std::string& path) {
  if (!IsObjName(path)) return ReadMesh(path);
  WEFT_ASSIGN_OR_RETURN(const std::string text, ReadWholeFile(path));
  return MeshFromObj(text, path);
}

}  // namespace weft
