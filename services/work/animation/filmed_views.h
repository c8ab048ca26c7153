// What the decoder finds in pictures of cloth that was simulated without them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/template.h"
#include "capture/rig/rig.h"
#include "figure/skeleton.h"
#include "pattern/board/board_index.h"
#include "services/formats/synthetic/frames_file.h"
#include "simulation/printed_mesh.h"
#include "simulation/synthetic_take.h"
#include "triangulation/triangulate.h"

namespace weft {

// Cloth before cameras, rendered and decoded, as `weft simulate` films it: with the wearer where the frame
// has a pose, with light, lenses, sensors and motion blur of the preset `shirt-drive`. A garment of the
// wardrobe is printed up to its seams; of others, faces whose vertices are not all of neighbouring cells are
// plain. Thread safety: const access.
class FilmedViews {
 public:
  // The studio stands around `first_mm`, the vertices of the take's first frame. FailedPrecondition: the
  // board is not the template's. Errors of BoardIndex.
  static absl::StatusOr<FilmedViews> Create(const Template& garment, const Board& board,
                                            const BodyShape& body,
                                            const std::vector<Eigen::Vector3d>& first_mm, uint64_t seed);

  // A frame and those beside it, from which all surfaces have their velocities; at an end of the take the
  // frame itself. `number` of the frame decides the sensors' noise.
  struct Moment {
    const ClothFrame& now;
    const ClothFrame& before;
    const ClothFrame& after;
    int number = 0;
  };
  // An entry per camera, in the order of the rig. Runs in the calling thread's TBB arena, the same
  // observations at any number of threads. Errors of StudioScene, RenderView and DecodeView.
  absl::StatusOr<std::vector<ViewObservations>> Observe(const Moment& moment, const Rig& rig) const;

 private:
  FilmedViews(const Template& garment, const BodyShape& body, BoardIndex index, SyntheticTakeOptions studio);

  std::vector<Face> faces_;
  ClothPrint print_;
  BodyShape body_;
  BoardIndex index_;
  SyntheticTakeOptions studio_;  // of which light, cameras and shutters are used
};

}  // namespace weft
