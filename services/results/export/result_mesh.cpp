#include "services/results/export/result_mesh.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/listed_file.h"
#include "services/formats/files/mesh_file.h"

namespace weft {
namespace {

absl::StatusOr<Ply> ReadCheckedPly(const std::string& path, const std::string& checksum) {
  WEFT_ASSIGN_OR_RETURN(const std::string bytes, ReadWholeFile(path));
  if (!checksum.empty() && ListedChecksum(bytes) != checksum) {
    return absl::DataLossError(absl::StrCat(path,
                                            ": is not as report.json lists it; `weft register` with the same "
                                            "inputs computes the frame again"));
  }
  return ParsePly(bytes, path);
}

bool IsMeasured(const Ply& ply) {
  const PlyElement* vertex = ply.Find("vertex");
  if (vertex == nullptr) return true;  // whoever reads it says what is wrong
  for (const char* const name : {"state", "sigma_mm", "views"})
    if (vertex->Find(name) != nullptr) return true;
  return false;
}

absl::StatusOr<RegisteredMesh> VerticesOf(const Ply& ply, const std::string& path) {
  if (IsMeasured(ply)) return RegisteredMeshFromPly(ply, path);
  WEFT_ASSIGN_OR_RETURN(const auto vertex, FindElement(ply, "vertex", path));
  RegisteredMesh mesh;
  WEFT_ASSIGN_OR_RETURN(mesh.vertices_mm, PositionsFromPly(*vertex, path));
  mesh.state.resize(mesh.vertices_mm.size());
  mesh.sigma_mm.resize(mesh.vertices_mm.size());
  mesh.views.resize(mesh.vertices_mm.size());
  return mesh;
}

}  // namespace

absl::StatusOr<CheckedMesh> ReadCheckedMesh(const std::string& path, const std::string& checksum) {
  WEFT_ASSIGN_OR_RETURN(const Ply ply, ReadCheckedPly(path, checksum));
  WEFT_ASSIGN_OR_RETURN(RegisteredMesh registered, VerticesOf(ply, path));
  WEFT_ASSIGN_OR_RETURN(TriangleMesh mesh, MeshFromPly(ply, path));
  return CheckedMesh{std::move(registered), std::move(mesh.faces), MeshTextureFromPly(ply), IsMeasured(ply)};
}

absl::StatusOr<RegisteredMesh> ReadCheckedVertices(const std::string& path, const std::string& checksum) {
  WEFT_ASSIGN_OR_RETURN(const Ply ply, ReadCheckedPly(path, checksum));
  return VerticesOf(ply, path);
}

}  // namespace weft
