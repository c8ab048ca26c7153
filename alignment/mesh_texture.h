// Texture coordinates of a garment's mesh: where on the print each corner of each face lies.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "alignment/garment_mesh.h"
#include "alignment/garment_parts.h"
#include "alignment/template.h"

namespace weft {

// The whole board as the texture: its picture (board.png) fits the mesh. `rows` and `cols` are the board's.
MeshTexture BoardTexture(const Template& garment, int rows, int cols);

// The panels as `parts` packs them into a square; the whole board where they are not packed but the size of
// the board is known; else empty.
MeshTexture TextureOf(const Template& garment, const GarmentParts& parts);

// The general case. `places` [vertices] are places on the print, in one unit along both axes, y upwards,
// inside `size`; those of vertices that are nothing of the board do not count. A face whose edges are about
// as long on the print as at rest keeps the places of its vertices. Any other closes a seam: it takes the
// side of most of its cells, which is continued over it. Deterministic.
MeshTexture SpreadTexture(const Template& garment, const std::vector<Eigen::Vector2d>& places,
                          const Eigen::Vector2d& size);

}  // namespace weft
