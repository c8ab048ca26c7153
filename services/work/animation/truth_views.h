// What cameras would see of cloth that was simulated without pictures.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/template.h"
#include "capture/rig/rig.h"
#include "figure/skeleton.h"
#include "services/formats/synthetic/frames_file.h"
#include "simulation/printed_mesh.h"
#include "triangulation/triangulate.h"

namespace weft {

// Cloth before cameras, and the decoder imitated (simulation/observation_model.h). The wearer hides cloth
// where the frame has a pose; otherwise the cloth alone does. Thread safety: const access.
class TruthViews {
 public:
  TruthViews(const Template& garment, const BodyShape& body);

  // An entry per camera, in the order of the rig. The same seed, frame and cameras give the same
  // observations. Runs in the calling thread's TBB arena. Errors of RayScene.
  absl::StatusOr<std::vector<ViewObservations>> Observe(const ClothFrame& frame, const Rig& rig,
                                                        uint64_t seed) const;

 private:
  std::vector<Face> faces_;
  PrintLocator print_;
  BodyShape body_;
};

// Where cameras stand around a garment.
struct DrivingPlaces {
  double arc_deg = 360;    // that they cover before its front; 360: at equal angles
  double distance_mm = 0;  // 0: that of the preset `shirt-drive`
};

// `cameras` around the garment, with lens and sensor of the preset `shirt-drive`; at equal angles two face
// each other. They see a garment of the size of `vertices_mm`, which they aim at.
absl::StatusOr<Rig> DrivingRig(int cameras, const std::vector<Eigen::Vector3d>& vertices_mm, uint64_t seed,
                               const DrivingPlaces& places = {});

}  // namespace weft
