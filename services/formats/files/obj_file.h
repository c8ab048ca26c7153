// Wavefront OBJ, as programs for modelling write meshes.
#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/mesh.h"

namespace weft {

struct ObjCorner {
  int vertex = 0;
  int texture = -1;  // -1: none

  bool operator==(const ObjCorner&) const = default;
};

// What a file says of its mesh: polygons of all groups and objects.
struct ObjMesh {
  std::vector<Eigen::Vector3d> vertices;  // in the order of the `v` lines, in the file's unit
  std::vector<Eigen::Vector2d> texture;   // in the order of the `vt` lines
  std::vector<std::vector<ObjCorner>> polygons;
};

// Normals and materials are not used. InvalidArgument names the file and what is wrong, a number also by its
// line: no vertices or faces, numbers that are none or not finite, a face with too few or too many corners,
// an index outside. Faces are counted from 1, as vertices are in the file. Unimplemented where this build has
// no reader.
absl::StatusOr<ObjMesh> ParseObj(std::string_view text, const std::string& source_name);

// The same without texture, where all faces are triangles. Errors of ParseObj, and InvalidArgument for a
// polygon.
absl::StatusOr<TriangleMesh> MeshFromObj(std::string_view text, const std::string& source_name);

// Whether the name of a file ends like one of OBJ.
bool IsObjName(const std::string& path);

// A mesh from elsewhere: OBJ by the ending of its name, else PLY (ReadMesh).
absl::StatusOr<TriangleMesh> ReadForeignMesh(const std::string& path);

}  // namespace weft
