// A coarser mesh of a garment, the same in all frames.
#pragma once

#include <cstddef>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/mesh.h"
#include "alignment/mesh_texture.h"

namespace weft {

struct ReducedMesh {
  std::vector<int> vertices;  // those of the mesh that are kept, ascending
  std::vector<Face> faces;    // indices into `vertices`
  MeshTexture texture;        // of these; the places on the print are those of the mesh
};

// At most `max_vertices` of the mesh's own vertices, spread evenly as DecimateMesh does. Vertices on seams
// count once for each place on the print; seams stay where they are. Deterministic. InvalidArgument: as
// DecimateMesh.
absl::StatusOr<ReducedMesh> ReduceMesh(const TriangleMesh& mesh, const MeshTexture& texture,
                                       size_t max_vertices);

}  // namespace weft
