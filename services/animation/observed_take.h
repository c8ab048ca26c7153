// What some cameras see of a take of known cloth, frame by frame.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/template.h"
#include "animation/evidence.h"
#include "capture/rig/rig.h"
#include "evaluation/driving_score.h"
#include "services/synthetic/frames_file.h"
#include "triangulation/triangulate.h"

namespace weft {

class ClothTake;

class ObservedTake {
 public:
  virtual ~ObservedTake() = default;
  // Of the cameras that look.
  virtual const Rig& rig() const = 0;
  // An entry per camera. `truth` is the frame's cloth. Runs in the calling thread's TBB arena.
  virtual absl::StatusOr<std::vector<ViewObservations>> Look(int frame, const ClothFrame& truth) = 0;
};

// `cameras` of them: those of the take where it has pictures, evenly chosen, or else where it has as many;
// otherwise cameras around the cloth of the first frame (DrivingRig). OutOfRange: a take with pictures has
// fewer. Errors of the take's files.
absl::StatusOr<std::unique_ptr<ObservedTake>> ObserveTake(ClothTake& take, const Template& garment,
                                                          int cameras, uint64_t seed);

// What a driver is given of them.
std::vector<DrivingView> DrivingViewsOf(const std::vector<ViewObservations>& seen, const Rig& rig);
// Directions from which vertices were seen, for scores.
VertexRays DirectionsOf(const std::vector<ViewObservations>& seen, const Rig& rig, const Template& garment,
                        const NodeVertices& nodes);

// Seen by these cameras, with the decoder imitated.
std::unique_ptr<ObservedTake> ObserveFrom(const ClothTake& take, const Template& garment, Rig rig,
                                          uint64_t seed);

}  // namespace weft
