// Small deterministic pictures of triangle meshes, for reports and quick looks.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "alignment/mesh.h"

namespace weft {

enum class MeshSide { kFront, kBack };

// Axes of a view, right-handed and of length 1.
struct Viewpoint {
  Eigen::Vector3d right = Eigen::Vector3d::UnitX();
  Eigen::Vector3d up = -Eigen::Vector3d::UnitY();
  Eigen::Vector3d towards_viewer = -Eigen::Vector3d::UnitZ();
};

// Looks at the broad side of the vertices with `up` up: along their narrowest principal axis, levelled; from
// above (front) or below (back) when they lie flat. Front is the side of a viewer who looks along +z (+y when
// `up` is along z); the back is seen after half a turn about `up`. Shapes as deep as wide are seen along that
// axis. InvalidArgument: no vertices, one that is not finite (named), `up` without direction.
absl::StatusOr<Viewpoint> ViewpointOf(const std::vector<Eigen::Vector3d>& vertices_mm, MeshSide side,
                                      const Eigen::Vector3d& up);

struct MeshViewOptions {
  int width_px = 480;
  int height_px = 560;
  int supersampling = 3;  // samples per pixel along x and y
  int margin_px = 8;
  double shading = 1;       // 0: the plain colours, 1: fully lit; less keeps colours readable as numbers
  bool transparent = true;  // otherwise a light background

  absl::Status Validate() const;
};

struct MeshView {
  int width_px = 0;
  int height_px = 0;
  double px_per_mm = 0;
  std::vector<uint8_t> rgba;  // [height_px, width_px, 4], sRGB, alpha not premultiplied
};

// Orthographic, framed to the mesh, smoothly shaded by a key light from the upper left. `colors`: sRGB from 0
// to 1, [vertices]. The side that faces show clockwise (the inside) is darker. The same bytes at every call;
// single-threaded, linear in faces and pixels.
// InvalidArgument: vertices that are not finite, faces with indices outside them (each named), no faces, no
// extent, colours of another number than the vertices.
absl::StatusOr<MeshView> RenderMesh(const TriangleMesh& mesh, const std::vector<Eigen::Vector3f>& colors,
                                    const Viewpoint& viewpoint, const MeshViewOptions& options);

// The picture as PNG bytes.
absl::StatusOr<std::string> EncodePng(const MeshView& view);

}  // namespace weft
