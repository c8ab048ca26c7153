#include "services/formats/files/garment_file.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <filesystem>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "alignment/mesh_texture.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/garment_parts_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/files/obj_file.h"
#include "services/formats/files/polygon_triangles.h"
#include "services/formats/files/template_file.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

// Across a garment, from a glove's finger to a stage costume: other sizes are another unit.
constexpr double kLeastGarmentMm = 30, kMostGarmentMm = 20'000;

absl::Status CheckSize(const std::string& path, const TriangleMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& v : mesh.vertices_mm) box.extend(v);
  const double across_mm = box.diagonal().norm();
  if (across_mm >= kLeastGarmentMm && across_mm <= kMostGarmentMm) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrFormat(
      "%s: the garment is %.4g mm across; the file does not say its unit: give the one that it "
      "was exported in, `weft garment import --unit m` makes a mesh in mm of it",
      path, across_mm));
}

// Cloth is not stretched so far, and units differ by more.
constexpr double kMostStretch = 2;

double AroundFaces_mm(const std::vector<Eigen::Vector3d>& vertices_mm,
                      const std::vector<std::array<int, 3>>& faces) {
  double sum = 0;
  for (const std::array<int, 3>& face : faces)
    for (int k = 0; k < 3; ++k) sum += (vertices_mm[face[k]] - vertices_mm[face[(k + 1) % 3]]).norm();
  return sum;
}

std::vector<Eigen::Vector3d> InMm(std::vector<Eigen::Vector3d> vertices, double unit_mm) {
  for (Eigen::Vector3d& v : vertices) v *= unit_mm;
  return vertices;
}

// Every corner of every face, or none.
absl::StatusOr<bool> HasTexture(const std::string& path, const ObjMesh& obj) {
  size_t with = 0, corners = 0, first_without = 0;
  bool found = false;
  for (size_t f = 0; f < obj.polygons.size(); ++f)
    for (const ObjCorner& corner : obj.polygons[f]) {
      ++corners;
      with += corner.texture >= 0 ? 1 : 0;
      if (corner.texture < 0 && !found) first_without = f, found = true;
    }
  if (with == 0 || with == corners) return with > 0;
  return absl::InvalidArgumentError(
      absl::StrCat(path, ": face ", first_without + 1,
                   " has no texture coordinates (vt), and other faces have some; unwrap the whole mesh (in "
                   "Blender: UV, Unwrap) and export it with UVs"));
}

void AddTriangles(const ObjMesh& obj, bool has_texture, GarmentMesh& garment) {
  std::vector<bool> is_placed(obj.vertices.size(), false);
  bool differ = false;
  if (has_texture) garment.texture.of_vertex.resize(obj.vertices.size(), Eigen::Vector2f::Zero());
  for (const std::vector<ObjCorner>& polygon : obj.polygons) {
    std::vector<Eigen::Vector3d> at;
    for (const ObjCorner& corner : polygon) at.push_back(obj.vertices[corner.vertex]);
    for (const std::array<int, 3>& triangle : TrianglesOfPolygon(at)) {
      Face face{};
      std::array<Eigen::Vector2f, 3> places;
      for (size_t k = 0; k < 3; ++k) {
        const ObjCorner& corner = polygon[static_cast<size_t>(triangle[k])];
        face[k] = corner.vertex;
        if (!has_texture) continue;
        places[k] = obj.texture[static_cast<size_t>(corner.texture)].cast<float>();
        Eigen::Vector2f& own = garment.texture.of_vertex[static_cast<size_t>(corner.vertex)];
        if (!is_placed[static_cast<size_t>(corner.vertex)]) own = places[k];
        is_placed[static_cast<size_t>(corner.vertex)] = true;
        differ = differ || own != places[k];
      }
      garment.rest.faces.push_back(face);
      if (has_texture) garment.texture.of_corner.push_back(places);
    }
  }
  if (!differ) garment.texture.of_corner.clear();
}

absl::StatusOr<ObjMesh> ReadObj(const std::string& path) {
  WEFT_ASSIGN_OR_RETURN(const std::string text, ReadWholeFile(path));
  return ParseObj(text, path);
}

absl::StatusOr<GarmentMesh> GarmentFromObj(const std::string& path, double unit_mm) {
  WEFT_ASSIGN_OR_RETURN(const ObjMesh obj, ReadObj(path));
  WEFT_ASSIGN_OR_RETURN(const bool has_texture, HasTexture(path, obj));
  GarmentMesh garment;
  garment.rest.vertices_mm = InMm(obj.vertices, unit_mm);
  AddTriangles(obj, has_texture, garment);
  return garment;
}

absl::StatusOr<GarmentMesh> GarmentFromPly(const std::string& path, double unit_mm) {
  WEFT_ASSIGN_OR_RETURN(const Ply ply, ReadPly(path));
  GarmentMesh garment;
  WEFT_ASSIGN_OR_RETURN(garment.rest, MeshFromPly(ply, path));
  garment.rest.vertices_mm = InMm(std::move(garment.rest.vertices_mm), unit_mm);
  garment.texture = MeshTextureFromPly(ply);
  const auto is_bad = [](const Eigen::Vector2f& place) { return !place.allFinite(); };
  bool any_bad = std::any_of(garment.texture.of_vertex.begin(), garment.texture.of_vertex.end(), is_bad);
  for (const auto& corners : garment.texture.of_corner)
    any_bad = any_bad || std::any_of(corners.begin(), corners.end(), is_bad);
  if (any_bad)
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": a texture coordinate is not finite; export the mesh again"));
  return garment;
}

// An OBJ or PLY.
absl::StatusOr<GarmentMesh> GarmentFromMesh(const std::string& path, double unit_mm) {
  absl::StatusOr<GarmentMesh> garment =
      IsObjName(path) ? GarmentFromObj(path, unit_mm) : GarmentFromPly(path, unit_mm);
  if (!garment.ok()) return garment;
  garment->id = fs::path(path).stem().string();
  const absl::Status status = CheckGarmentMesh(garment->rest);
  if (!status.ok())
    return absl::Status(
        status.code(),
        absl::StrCat(
            path, ": ", status.message(),
            " (triangles and vertices are counted from 0); repair the mesh (in Blender: Select All by "
            "Trait, Non Manifold; Merge by Distance) and export it again"));
  WEFT_RETURN_IF_ERROR(CheckSize(path, garment->rest));
  return garment;
}

absl::StatusOr<GarmentMesh> GarmentFromTemplate(const std::string& path) {
  WEFT_ASSIGN_OR_RETURN(const Template garment, ReadTemplate(path));
  WEFT_ASSIGN_OR_RETURN(const GarmentParts parts, ReadGarmentParts(path));
  GarmentMesh mesh = garment;
  mesh.texture = TextureOf(garment, parts);
  return mesh;
}

// Whether the triangles of `faces` are those of the polygons: each polygon's follow each other and have its
// corners alone.
bool AreTrianglesOf(const std::vector<Face>& faces, const ObjMesh& obj) {
  size_t next = 0;
  for (const std::vector<ObjCorner>& polygon : obj.polygons) {
    const size_t end = next + polygon.size() - 2;
    if (end > faces.size()) return false;
    for (; next < end; ++next)
      for (const int v : faces[next])
        if (std::none_of(polygon.begin(), polygon.end(),
                         [v](const ObjCorner& corner) { return corner.vertex == v; }))
          return false;
  }
  return next == faces.size();
}

}  // namespace

bool IsMeshName(const std::string& path) {
  return IsObjName(path) || absl::AsciiStrToLower(fs::path(path).extension().string()) == ".ply";
}

absl::StatusOr<GarmentMesh> ReadGarmentMesh(const std::string& path, double unit_mm) {
  return IsMeshName(path) ? GarmentFromMesh(path, unit_mm) : GarmentFromTemplate(path);
}

absl::StatusOr<std::vector<Eigen::Vector3d>> ReadGarmentMoment(const std::string& path,
                                                               const GarmentMesh& garment, double unit_mm) {
  TriangleMesh mesh;
  bool same = false;
  if (IsObjName(path)) {
    WEFT_ASSIGN_OR_RETURN(const ObjMesh obj, ReadObj(path));
    mesh.vertices_mm = InMm(obj.vertices, unit_mm);
    same = AreTrianglesOf(garment.rest.faces, obj);
  } else {
    WEFT_ASSIGN_OR_RETURN(mesh, ReadMesh(path));
    mesh.vertices_mm = InMm(std::move(mesh.vertices_mm), unit_mm);
    same = mesh.faces == garment.rest.faces;
  }
  if (!same || mesh.vertices_mm.size() != garment.rest.vertices_mm.size())
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": has other vertices or faces than ", garment.id,
                     "; export all frames of one mesh, with modifiers that do not change its faces"));
  WEFT_RETURN_IF_ERROR(CheckSize(path, mesh));
  const double stretch = AroundFaces_mm(mesh.vertices_mm, garment.rest.faces) /
                         AroundFaces_mm(garment.rest.vertices_mm, garment.rest.faces);
  if (!(stretch < kMostStretch && stretch * kMostStretch > 1))
    return absl::InvalidArgumentError(
        absl::StrFormat("%s: its edges are %.3g times as long as those of %s; export all frames in one unit",
                        path, stretch, garment.id));
  return std::move(mesh.vertices_mm);
}

}  // namespace weft
