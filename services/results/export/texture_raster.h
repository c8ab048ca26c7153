// Texels of a garment's texture and the places of its mesh that they show.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/mesh.h"
#include "alignment/mesh_texture.h"

namespace weft {

inline constexpr int kMaxAtlasPx = 16384;

// Where the centre of a texel lies on the mesh: a face, and the weights of its second and third corner.
struct Texel {
  int face = -1;  // none
  float weight_b = 0, weight_c = 0;
};

// [size_px, size_px], row 0 at v = 1. Where faces overlap, the last one counts. InvalidArgument: a size
// beyond 1 to kMaxAtlasPx, or no texture coordinates; `option` is what asked for them.
absl::StatusOr<std::vector<Texel>> RasterizeTexture(int size_px, const std::vector<Face>& faces,
                                                    const MeshTexture& texture, const char* option);

// Gives texels beside those with a value the mean of these, some texels far, so that filtering does not mix
// in what lies outside the garment. `values` [size_px, size_px]: three components, and above 0 where there is
// a value.
void AddGutter(int size_px, std::vector<Eigen::Vector4f>& values);

}  // namespace weft
