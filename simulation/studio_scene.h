// A printed cloth at one moment in the lit studio, ready to be seen by any camera.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/mesh.h"
#include "pattern/board.h"
#include "simulation/appearance.h"
#include "simulation/printed_mesh.h"
#include "simulation/ray_scene.h"

namespace weft {

// What is behind the cloth: a soft, uneven wall that the light reaches, by direction only.
struct BackdropOptions {
  Eigen::Vector3f color = {0.075f, 0.080f, 0.090f};  // linear
  float variation = 0.5f;                            // of its brightness, relative, 0 to 1
  uint64_t seed = 1;
};

struct StudioOptions {
  InkOptions inks;
  LightOptions light;
  BackdropOptions backdrop;

  absl::Status Validate() const;
};

// Immutable; any number of threads may look at it.
class StudioScene {
 public:
  // Any mesh that carries a print of `board` will do; faces without print look like thread in the colour of
  // the lines. Casts the light in the calling thread's TBB arena. InvalidArgument: options, board or mesh do
  // not fit, named.
  static absl::StatusOr<StudioScene> Build(TriangleMesh mesh, ClothPrint print, Board board,
                                           const StudioOptions& options);

  const TriangleMesh& mesh() const { return mesh_; }
  const ClothPrint& print() const { return print_; }
  const Board& board() const { return board_; }
  const RayScene& rays() const { return rays_; }

  // Linear light that reaches a camera from a hit, or from the backdrop where `hit` is none; `direction` is
  // the ray's, any length.
  Eigen::Vector3f Radiance(const RayHit& hit, const Eigen::Vector3f& direction) const;

 private:
  // A wave of the backdrop's brightness around the vertical axis, drifting with the height.
  struct Wave {
    float around = 0, drift = 0, phase = 0;
  };

  void HangBackdrop();
  Eigen::Vector3f Backdrop(const Eigen::Vector3f& direction) const;

  TriangleMesh mesh_;
  ClothPrint print_;
  Board board_;
  StudioOptions options_;
  RayScene rays_;
  VertexLight light_;
  std::array<Wave, 3> waves_;
};

}  // namespace weft
