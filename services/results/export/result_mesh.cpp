#include "services/results/export/result_mesh.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/status_macros.h"
#include "capture/file/checksum.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/mesh_file.h"

namespace weft {
namespace {

absl::StatusOr<Ply> ReadCheckedPly(const std::string& path, const std::string& checksum) {
  WEFT_ASSIGN_OR_RETURN(const std::string bytes, ReadWholeFile(path));
  if (!checksum.empty() && absl::StrFormat("%016x", Checksum(bytes.data(), bytes.size())) != checksum) {
    return absl::DataLossError(absl::StrCat(path,
                                            ": is not as report.json lists it; `weft register` with the same "
                                            "inputs computes the frame again"));
  }
  return ParsePly(bytes, path);
}

}  // namespace

absl::StatusOr<CheckedMesh> ReadCheckedMesh(const std::string& path, const std::string& checksum) {
  WEFT_ASSIGN_OR_RETURN(const Ply ply, ReadCheckedPly(path, checksum));
  WEFT_ASSIGN_OR_RETURN(RegisteredMesh registered, RegisteredMeshFromPly(ply, path));
  WEFT_ASSIGN_OR_RETURN(TriangleMesh mesh, MeshFromPly(ply, path));
  return CheckedMesh{std::move(registered), std::move(mesh.faces), MeshTextureFromPly(ply)};
}

absl::StatusOr<RegisteredMesh> ReadCheckedVertices(const std::string& path, const std::string& checksum) {
  WEFT_ASSIGN_OR_RETURN(const Ply ply, ReadCheckedPly(path, checksum));
  return RegisteredMeshFromPly(ply, path);
}

}  // namespace weft
