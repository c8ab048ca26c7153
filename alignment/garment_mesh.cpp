#include "alignment/garment_mesh.h"

#include <algorithm>
#include <set>
#include <string_view>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/file/content_hash.h"

namespace weft {
namespace {

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
  struct EdgeSide {
    int low, high, face;
  };
  std::vector<EdgeSide> sides;
  sides.reserve(3 * mesh.faces.size());
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    for (int i = 0; i < 3; ++i) {
      const int a = mesh.faces[f][i], b = mesh.faces[f][(i + 1) % 3];
      sides.push_back({std::min(a, b), std::max(a, b), static_cast<int>(f)});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const EdgeSide& a, const EdgeSide& b) {
    return std::tie(a.low, a.high, a.face) < std::tie(b.low, b.high, b.face);
  });
  // The first face, in the order of the mesh, that is one too many at an edge.
  const EdgeSide* first = nullptr;
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

std::string GarmentMesh::MeshHash() const {
  ContentHash hash;
  hash.Add("garment mesh");
  hash.AddInteger(rest.vertices_mm.size());
  for (const Eigen::Vector3d& v : rest.vertices_mm) hash.AddNumber(v.x()).AddNumber(v.y()).AddNumber(v.z());
  hash.AddInteger(rest.faces.size());
  for (const Face& face : rest.faces)
    for (const int v : face) hash.AddInteger(static_cast<uint64_t>(v));
  return hash.Hex();
}

absl::Status CheckGarmentMesh(const TriangleMesh& mesh) {
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

absl::Status CheckGarmentSpans(const GarmentMesh& garment) {
  const auto bad = [&](size_t i, const std::string& why) {
    return absl::InvalidArgumentError(
        absl::StrCat("garments[", i, "] (", garment.garments[i].id, "): ", why));
  };
  const int vertices = static_cast<int>(garment.rest.vertices_mm.size());
  const int faces = static_cast<int>(garment.rest.faces.size());
  std::set<std::string_view> ids;
  int vertex = 0, face = 0;
  for (size_t i = 0; i < garment.garments.size(); ++i) {
    const GarmentSpan& one = garment.garments[i];
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

}  // namespace weft
