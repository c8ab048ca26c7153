// A garment's mesh from its file: a template, or a mesh of another program that no board was printed on.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/garment_mesh.h"

namespace weft {

// Whether this names a mesh (.obj, .ply) rather than a template's folder or its template.json.
bool IsMeshName(const std::string& path);

// A template (ReadTemplate) without its board, or an OBJ or PLY. Of these `unit_mm` is the unit, which the
// files do not say; their id is the name of the file. Vertices are in the order of the file. Polygons of an
// OBJ are split into triangles. Texture coordinates that differ between faces at a vertex are seams: the
// vertex stays one. They may be missing altogether. InvalidArgument names the file and what to do: what is no
// cloth (CheckGarmentMesh), faces without texture coordinates beside others that have some, a size that no
// garment has. Errors of ParseObj, ReadPly, ReadTemplate.
absl::StatusOr<GarmentMesh> ReadGarmentMesh(const std::string& path, double unit_mm = 1);

// Where the vertices of the same mesh are at another moment, in mm. InvalidArgument: the file has other
// vertices or faces than `garment`, or is in another unit.
absl::StatusOr<std::vector<Eigen::Vector3d>> ReadGarmentMoment(const std::string& path,
                                                               const GarmentMesh& garment,
                                                               double unit_mm = 1);

}  // namespace weft
