// The garment's texture, unwrapped from the pictures of all cameras.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "alignment/mesh.h"
#include "alignment/mesh_texture.h"
#include "capture/image/frame.h"
#include "capture/rig/camera_model.h"
#include "evaluation/vertex_views.h"
#include "services/results/export/texture_raster.h"

namespace weft {

// Red, green, blue and opacity, [size_px, size_px, 4] bytes, row 0 at v = 1. Texels that no camera sees are
// transparent black; those next to seen ones get their colour, so that filtering does not darken edges.
struct AtlasPicture {
  int size_px = 0;
  std::vector<uint8_t> rgba;
  double covered = 0;  // share of the garment's texels that a camera sees
};

// Red, green and blue [size_px, size_px, 3], for files without transparency: texels that no camera sees get
// colours that run smoothly from those around them.
std::vector<uint8_t> FilledRgb(const AtlasPicture& picture);

// One atlas serves all frames of a garment. Thread safety: none; it uses the calling thread's TBB arena.
class TextureAtlas {
 public:
  // InvalidArgument: a size beyond 1 to kMaxAtlasPx, or no texture coordinates.
  static absl::StatusOr<TextureAtlas> Make(int size_px, const std::vector<Face>& faces,
                                           const MeshTexture& texture);

  // Adds what a camera sees of the mesh, whose faces are those of the atlas. Cameras that see a place from
  // the front and from near count most: cos^4 of the angle times the pixels per mm^2. InvalidArgument: no
  // picture.
  absl::Status Add(const Frame& picture, const VisibleMesh& mesh, const CameraModel& camera);
  // The picture of what was added since the last one. The same bytes at any number of threads.
  AtlasPicture Take();

 private:
  int size_px_ = 0;
  std::vector<Face> faces_;
  std::vector<Texel> texels_;            // [size_px, size_px]
  std::vector<Eigen::Vector4f> colors_;  // as texels_: weighted sums, and the weights
};

}  // namespace weft
