// Wavefront OBJ, as programs for modelling write meshes.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "alignment/mesh.h"

namespace weft {

// Vertices in the order of the file's `v` lines, and triangles of all groups and objects, in its unit.
// Texture coordinates, normals and materials are not used. InvalidArgument names the file and what is wrong:
// no vertices or faces, a polygon, an index outside the vertices. Unimplemented where this build has no
// reader.
absl::StatusOr<TriangleMesh> MeshFromObj(std::string_view text, const std::string& source_name);

// A mesh from elsewhere: OBJ by the ending of its name, else PLY (ReadMesh).
absl::StatusOr<TriangleMesh> ReadForeignMesh(const std::string& path);

}  // namespace weft
