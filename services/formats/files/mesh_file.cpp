#include "services/formats/files/mesh_file.h"

#include <array>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"

namespace weft {
namespace {

constexpr size_t kCornersUv = 6;  // u v of three corners

absl::StatusOr<std::vector<Face>> FacesFromPly(const PlyElement& element, size_t vertices,
                                               const std::string& source_name) {
  const PlyProperty* indices = element.Find("vertex_indices");
  if (!indices) indices = element.Find("vertex_index");
  if (!indices || !indices->is_list) {
    return absl::InvalidArgumentError(
        absl::StrCat(source_name, ": element face has no list property vertex_indices"));
  }
  std::vector<Face> faces(element.rows);
  for (size_t row = 0; row < element.rows; ++row) {
    const size_t begin = indices->list_start[row], corners = indices->list_start[row + 1] - begin;
    if (corners != 3) {
      return absl::InvalidArgumentError(absl::StrCat(source_name, ": face ", row, " has ", corners,
                                                     " corners; triangulate the mesh first"));
    }
    for (int k = 0; k < 3; ++k) {
      const double index = indices->values[begin + k];
      if (!(index >= 0 && index < static_cast<double>(vertices)) || index != std::floor(index)) {
        return absl::InvalidArgumentError(absl::StrCat(source_name, ": face ", row, " names vertex ", index,
                                                       ", the file has ", vertices, " vertices"));
      }
      faces[row][k] = static_cast<int>(index);
    }
  }
  return faces;
}

}  // namespace

PlyElement FaceElement(const std::vector<Face>& faces, const MeshTexture& texture) {
  PlyProperty indices = PlyColumn("vertex_indices", PlyType::kInt32, {});
  indices.is_list = true;
  indices.values.reserve(faces.size() * 3);
  indices.list_start.push_back(0);
  for (const Face& face : faces) {
    indices.values.insert(indices.values.end(), face.begin(), face.end());
    indices.list_start.push_back(indices.values.size());
  }
  PlyElement element{"face", faces.size(), {}};
  element.properties.push_back(std::move(indices));
  if (texture.of_corner.empty()) return element;
  PlyProperty places = PlyColumn("texcoord", PlyType::kFloat32, {});
  places.is_list = true;
  places.values.reserve(faces.size() * 6);
  places.list_start.push_back(0);
  for (const auto& corners : texture.of_corner) {
    for (const Eigen::Vector2f& place : corners) {
      places.values.insert(places.values.end(), {place.x(), place.y()});
    }
    places.list_start.push_back(places.values.size());
  }
  element.properties.push_back(std::move(places));
  return element;
}

void AddTextureColumns(const MeshTexture& texture, PlyElement& vertex) {
  if (!texture.empty()) AddPlyColumns({"s", "t"}, PlyType::kFloat32, texture.of_vertex, vertex);
}

absl::StatusOr<const PlyElement*> FindElement(const Ply& ply, std::string_view element,
                                              const std::string& source_name) {
  if (const PlyElement* found = ply.Find(element)) return found;
  return absl::InvalidArgumentError(absl::StrCat(source_name, ": has no element ", std::string(element)));
}

absl::StatusOr<const PlyProperty*> ScalarColumn(const PlyElement& element, std::string_view property,
                                                const std::string& source_name) {
  const PlyProperty* column = element.Find(property);
  if (column && !column->is_list) return column;
  return absl::InvalidArgumentError(absl::StrCat(source_name, ": element ", element.name, " has no ",
                                                 column ? "scalar " : "", "property ",
                                                 std::string(property)));
}

absl::StatusOr<std::vector<Eigen::Vector3d>> PositionsFromPly(const PlyElement& element,
                                                              const std::string& source_name) {
  std::vector<Eigen::Vector3d> positions(element.rows);
  for (int axis = 0; axis < 3; ++axis) {
    WEFT_ASSIGN_OR_RETURN(const auto column,
                          ScalarColumn(element, std::string(1, static_cast<char>('x' + axis)), source_name));
    for (size_t row = 0; row < element.rows; ++row) {
      const double value = column->values[row];
      if (!std::isfinite(value)) {
        return absl::InvalidArgumentError(absl::StrCat(source_name, ": element ", element.name, ", row ", row,
                                                       ", property ", column->name, ": not a finite number"));
      }
      positions[row][axis] = value;
    }
  }
  return positions;
}

absl::StatusOr<TriangleMesh> MeshFromPly(const Ply& ply, const std::string& source_name) {
  WEFT_ASSIGN_OR_RETURN(const auto vertex, FindElement(ply, "vertex", source_name));
  WEFT_ASSIGN_OR_RETURN(const auto face, FindElement(ply, "face", source_name));
  WEFT_ASSIGN_OR_RETURN(auto positions, PositionsFromPly(*vertex, source_name));
  WEFT_ASSIGN_OR_RETURN(auto faces, FacesFromPly(*face, positions.size(), source_name));
  return TriangleMesh{std::move(positions), std::move(faces)};
}

absl::StatusOr<TriangleMesh> ReadMesh(const std::string& path, uint64_t max_bytes) {
  WEFT_ASSIGN_OR_RETURN(const Ply ply, ReadPly(path, max_bytes));
  return MeshFromPly(ply, path);
}

MeshTexture MeshTextureFromPly(const Ply& ply) {
  MeshTexture texture;
  const PlyElement *at_vertices = ply.Find("vertex"), *at_faces = ply.Find("face");
  if (at_vertices == nullptr || at_faces == nullptr) return texture;
  const PlyElement &vertex = *at_vertices, &face = *at_faces;
  const PlyProperty *s = vertex.Find("s"), *t = vertex.Find("t"), *corners = face.Find("texcoord");
  if (s == nullptr || t == nullptr || s->is_list || t->is_list) return texture;
  for (size_t v = 0; v < vertex.rows; ++v)
    texture.of_vertex.emplace_back(static_cast<float>(s->values[v]), static_cast<float>(t->values[v]));
  if (corners == nullptr || !corners->is_list || corners->values.size() != kCornersUv * face.rows)
    return texture;
  for (size_t f = 0; f < face.rows; ++f) {
    auto& uv = texture.of_corner.emplace_back();
    for (size_t k = 0; k < uv.size(); ++k) {
      const double* values = &corners->values[kCornersUv * f + 2 * k];
      uv[k] = Eigen::Vector2d(values[0], values[1]).cast<float>();
    }
  }
  return texture;
}

absl::Status WriteMesh(const std::string& path, const TriangleMesh& mesh, const MeshTexture& texture) {
  PlyElement vertex{"vertex", mesh.vertices_mm.size(), {}};
  AddPlyColumns({"x", "y", "z"}, PlyType::kFloat64, mesh.vertices_mm, vertex);
  AddTextureColumns(texture, vertex);
  Ply ply;
  ply.comments.push_back("positions in mm");
  ply.elements = {std::move(vertex), FaceElement(mesh.faces, texture)};
  return WritePly(path, ply);
}

absl::Status WriteRegisteredMesh(const std::string& path, const RegisteredMesh& mesh,
                                 const std::vector<Face>& faces, const MeshTexture& texture) {
  PlyElement vertex{"vertex", mesh.vertices_mm.size(), {}};
  AddPlyColumns({"x", "y", "z"}, PlyType::kFloat32, mesh.vertices_mm, vertex);
  vertex.properties.push_back(
      PlyColumn("state", PlyType::kUint8, mesh.state, [](VertexState state) { return state; }));
  vertex.properties.push_back(PlyColumn("sigma_mm", PlyType::kFloat32,
                                        std::vector<double>(mesh.sigma_mm.begin(), mesh.sigma_mm.end())));
  vertex.properties.push_back(
      PlyColumn("views", PlyType::kInt32, std::vector<double>(mesh.views.begin(), mesh.views.end())));
  AddTextureColumns(texture, vertex);
  Ply ply;
  ply.comments.push_back(
      "positions in mm; state 0 inferred, 1 observed, 2 by two views, 3 bridged, 4 driven");
  ply.elements = {std::move(vertex), FaceElement(faces, texture)};
  return WritePly(path, ply);
}

absl::StatusOr<RegisteredMesh> ReadRegisteredMesh(const std::string& path) {
  WEFT_ASSIGN_OR_RETURN(const Ply ply, ReadPly(path));
  return RegisteredMeshFromPly(ply, path);
}

absl::StatusOr<RegisteredMesh> RegisteredMeshFromPly(const Ply& ply, const std::string& source_name) {
  WEFT_ASSIGN_OR_RETURN(const auto vertex, FindElement(ply, "vertex", source_name));
  WEFT_ASSIGN_OR_RETURN(auto positions, PositionsFromPly(*vertex, source_name));
  std::array<const PlyProperty*, 3> columns{};
  constexpr std::array<std::string_view, 3> kNames = {"state", "sigma_mm", "views"};
  for (size_t i = 0; i < columns.size(); ++i) {
    WEFT_ASSIGN_OR_RETURN(columns[i], ScalarColumn(*vertex, kNames[i], source_name));
  }
  RegisteredMesh mesh;
  mesh.vertices_mm = std::move(positions);
  for (size_t row = 0; row < mesh.vertices_mm.size(); ++row) {
    const double state = columns[0]->values[row], views = columns[2]->values[row];
    if (!(state >= 0 && state <= 4 && state == std::floor(state))) {
      return absl::InvalidArgumentError(absl::StrCat(source_name, ": element vertex, row ", row,
                                                     ", property state: is ", state, ", expected 0 to 4"));
    }
    if (!(views >= 0 && views <= 1e6)) {
      return absl::InvalidArgumentError(absl::StrCat(source_name, ": element vertex, row ", row,
                                                     ", property views: ", views, " is no count"));
    }
    mesh.state.push_back(static_cast<VertexState>(state));
    mesh.sigma_mm.push_back(static_cast<float>(columns[1]->values[row]));
    mesh.views.push_back(static_cast<int>(views));
  }
  return mesh;
}

}  // namespace weft
