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

constexpr size_t kCornersUv = 6;  // u v of three corners

absl::StatusOr<Ply> ReadCheckedPly(const std::string& path, const std::string& checksum) {
  WEFT_ASSIGN_OR_RETURN(const std::string bytes, ReadWholeFile(path));
  if (!checksum.empty() && absl::StrFormat("%016x", Checksum(bytes.data(), bytes.size())) != checksum) {
    return absl::DataLossError(absl::StrCat(path,
                                            ": is not as report.json lists it; `weft register` with the same "
                                            "inputs computes the frame again"));
  }
  return ParsePly(bytes, path);
}

MeshTexture TextureOfPly(const Ply& ply) {
  const PlyElement& vertex = *ply.Find("vertex");
  const PlyElement& face = *ply.Find("face");
  const PlyProperty *s = vertex.Find("s"), *t = vertex.Find("t"), *corners = face.Find("texcoord");
  MeshTexture texture;
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

}  // namespace

absl::StatusOr<CheckedMesh> ReadCheckedMesh(const std::string& path, const std::string& checksum) {
  WEFT_ASSIGN_OR_RETURN(const Ply ply, ReadCheckedPly(path, checksum));
  WEFT_ASSIGN_OR_RETURN(RegisteredMesh registered, RegisteredMeshFromPly(ply, path));
  WEFT_ASSIGN_OR_RETURN(TriangleMesh mesh, MeshFromPly(ply, path));
  return CheckedMesh{std::move(registered), std::move(mesh.faces), TextureOfPly(ply)};
}

absl::StatusOr<RegisteredMesh> ReadCheckedVertices(const std::string& path, const std::string& checksum) {
  WEFT_ASSIGN_OR_RETURN(const Ply ply, ReadCheckedPly(path, checksum));
  return RegisteredMeshFromPly(ply, path);
}

}  // namespace weft
