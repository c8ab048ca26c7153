// Vertices for formats with one texture coordinate a vertex.
#pragma once

#include <vector>

#include "alignment/mesh.h"
#include "alignment/mesh_texture.h"

namespace weft {

// A mesh whose vertices on seams occur once for each place on the print. The first vertices are those of the
// mesh it was made from, in their order; copies follow. Each of the first keeps a face where it had one,
// since Blender drops vertices without.
struct SplitMesh {
  std::vector<int> origin;  // [vertices here]: which vertex of the mesh
  std::vector<Face> faces;
  std::vector<Eigen::Vector2f> uv;  // [vertices here]; empty without texture
};

// `vertices`: of the mesh.
SplitMesh SplitAtSeams(size_t vertices, const std::vector<Face>& faces, const MeshTexture& texture);

}  // namespace weft
