// Triangle meshes as PLY: templates, results and ground truth.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/garment_mesh.h"
#include "alignment/mesh.h"
#include "services/formats/files/ply.h"

namespace weft {

// Vertices x y z (mm) and triangles (vertex_indices or vertex_index) of a PLY file; other properties are
// ignored. InvalidArgument names the file and the vertex or face: missing properties, coordinates that are
// not finite, polygons, indices outside the vertices.
absl::StatusOr<TriangleMesh> MeshFromPly(const Ply& ply, const std::string& source_name);
absl::StatusOr<TriangleMesh> ReadMesh(const std::string& path, uint64_t max_bytes = uint64_t{4} << 30);

// The texture as WriteMesh writes it; empty where the file has none.
MeshTexture MeshTextureFromPly(const Ply& ply);

// Coordinates in double precision, so that the mesh read back hashes the same. A texture, where there is one,
// is properties s and t of the vertices, and a list texcoord (u v of each corner) of the faces where they
// need it.
absl::Status WriteMesh(const std::string& path, const TriangleMesh& mesh, const MeshTexture& texture = {});

// mesh.ply of a job: x y z, state (0 inferred, 1 observed), sigma_mm, views, texture as above; coordinates in
// single precision. InvalidArgument when the vectors of `mesh` or `texture` differ in length.
absl::Status WriteRegisteredMesh(const std::string& path, const RegisteredMesh& mesh,
                                 const std::vector<Face>& faces, const MeshTexture& texture = {});
// Reads it back; state, sigma_mm and views must be there.
absl::StatusOr<RegisteredMesh> ReadRegisteredMesh(const std::string& path);
absl::StatusOr<RegisteredMesh> RegisteredMeshFromPly(const Ply& ply, const std::string& source_name);

// The element `face`; `texture` of as many faces, or empty.
PlyElement FaceElement(const std::vector<Face>& faces, const MeshTexture& texture);
// The columns s and t, where there is a texture.
void AddTextureColumns(const MeshTexture& texture, PlyElement& vertex);

// The columns of a property triple, e.g. x y z. InvalidArgument names file, element and the missing property.
absl::StatusOr<std::vector<Eigen::Vector3d>> PositionsFromPly(const PlyElement& element,
                                                              const std::string& source_name);
// A scalar column. InvalidArgument as above.
absl::StatusOr<const PlyProperty*> ScalarColumn(const PlyElement& element, std::string_view property,
                                                const std::string& source_name);
// An element. InvalidArgument names the file and the element.
absl::StatusOr<const PlyElement*> FindElement(const Ply& ply, std::string_view element,
                                              const std::string& source_name);

}  // namespace weft
