// What some cameras see of a take of known cloth, frame by frame.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/template.h"
#include "animation/rays/evidence.h"
#include "capture/rig/rig.h"
#include "evaluation/driving_score.h"
#include "services/formats/synthetic/frames_file.h"
#include "triangulation/triangulate.h"

namespace weft {

class ClothTake;

class ObservedTake {
 public:
  virtual ~ObservedTake() = default;
  // Of the cameras that look.
  virtual const Rig& rig() const = 0;
  // An entry per camera. `truth` is the frame's cloth. Runs in the calling thread's TBB arena.
  virtual absl::StatusOr<std::vector<ViewObservations>> Observe(int frame, const ClothFrame& truth) = 0;
};

// How takes without pictures are looked at.
struct Observing {
  const Template& garment;
  uint64_t seed = 1;  // of imitated observations, and of studio and sensors
  // Pictures are rendered and decoded (filmed_views.h), each frame once for an ObservedTake; otherwise the
  // decoder is imitated.
  bool films = false;
};

// `cameras` of them: those of the take where it has pictures, evenly chosen, or else where it has as many;
// otherwise cameras around the cloth of the first frame (DrivingRig). OutOfRange: a take with pictures has
// fewer. Errors of the take's files and of FilmedViews.
absl::StatusOr<std::unique_ptr<ObservedTake>> ObserveTake(ClothTake& take, int cameras,
                                                          const Observing& observing);
// A take without pictures, before these cameras.
absl::StatusOr<std::unique_ptr<ObservedTake>> ObserveFrom(ClothTake& take, Rig rig,
                                                          const Observing& observing);

// Directions from which vertices were seen, for scores.
VertexRays DirectionsOf(const std::vector<ViewObservations>& seen, const Rig& rig, const Template& garment,
                        const NodeVertices& nodes);

}  // namespace weft
