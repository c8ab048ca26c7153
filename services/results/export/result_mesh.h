// mesh.ply of a result with faces and texture, checked against what its report lists.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/garment_mesh.h"
#include "alignment/mesh.h"

namespace weft {

struct CheckedMesh {
  RegisteredMesh registered;
  std::vector<Face> faces;
  MeshTexture texture;      // empty: the file has none
  bool is_measured = true;  // false: the file tells no states, sigmas and views, and those above mean nothing
};

// `checksum`: of the file, as report.json lists it; empty is not checked (reports of earlier versions).
// A mesh that was imported, not registered, has none of state, sigma_mm and views. DataLoss: the file has
// another. InvalidArgument: it is no such mesh. NotFound. Messages name the file.
absl::StatusOr<CheckedMesh> ReadCheckedMesh(const std::string& path, const std::string& checksum);
// The vertices alone.
absl::StatusOr<RegisteredMesh> ReadCheckedVertices(const std::string& path, const std::string& checksum);

}  // namespace weft
