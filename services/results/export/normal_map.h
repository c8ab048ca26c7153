// Normal maps: what a coarser mesh of a garment lacks of its surface.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/mesh.h"
#include "alignment/mesh_texture.h"
#include "services/results/export/reduced_mesh.h"
#include "services/results/export/split_vertices.h"
#include "services/results/export/texture_raster.h"

namespace weft {

// One serves all frames of a garment. Thread safety: none; it uses the calling thread's TBB arena.
class NormalMap {
 public:
  // `faces` and `texture` are those of the whole mesh, `base` is made from it. InvalidArgument: as
  // RasterizeTexture; a base that lacks no vertex.
  static absl::StatusOr<NormalMap> Make(int size_px, std::vector<Face> faces, const MeshTexture& texture,
                                        ReducedMesh base);

  // [size_px, size_px, 3] bytes, row 0 at v = 1. A texel is the normal of the whole mesh at that place of the
  // print, interpolated between its vertices, in the tangent space of the base at the same place: red along
  // u, green along v (upwards: the convention of OpenGL and glTF), blue outwards; -1 to 1 as 0 to 255.
  // Tangents are those of MikkTSpace (Mikkelsen, Simulation of Wrinkled Surfaces Revisited, 2008,
  // section 3.2), so that readers that compute their own get the same. Outside the garment it is flat.
  // `vertices` [of the whole mesh], in any unit and axes. The same bytes at any number of threads.
  std::vector<uint8_t> Bake(const std::vector<Eigen::Vector3d>& vertices) const;

  // The tangents by which it is baked, of length 1, and -1 where the print is mirrored, as glTF's TANGENT
  // has them: the bitangent is the last number times normal x tangent. Of the vertices of SplitAtSeams of
  // the base.
  std::vector<Eigen::Vector4f> Tangents(const std::vector<Eigen::Vector3d>& vertices) const;

 private:
  struct TangentFrame {
    Eigen::Vector3d normal, tangent;
    double side = 1;  // -1 where the print is mirrored
  };
  // Of `base_split_`.
  std::vector<TangentFrame> TangentFrames(const std::vector<Eigen::Vector3d>& vertices) const;

  int size_px_ = 0;
  std::vector<Face> faces_;
  ReducedMesh base_;
  SplitMesh base_split_;
  std::vector<Texel> whole_texels_, base_texels_;  // [size_px, size_px]
};

}  // namespace weft
