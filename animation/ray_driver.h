// Registers a garment from rays, frame after frame: shape followed in time, polish, and how far both are off.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/align.h"
#include "animation/evidence.h"
#include "animation/ray_polish.h"
#include "animation/sparse_view_avatar.h"
#include "animation/view_tracker.h"

namespace weft {

struct RayDriverOptions {
  TrackerOptions tracker;
  PolishOptions polish;

  absl::Status Validate() const;
};

struct StageTime {
  std::string name;  // "track", "polish", ...
  double time_ms = 0;
};

struct RayDrivenFrame {
  GarmentTrack track;
  std::vector<Eigen::Vector3d> carrier_mm, position_mm;  // [vertices]; equal where the frame is lost
  std::vector<int> rays_of_vertex;                       // [vertices], that were not rejected
  int rejected_rays = 0;
  int cameras = 0;  // with rays
  // What errors grow with, [vertices]. With two rays and more it is where they cross. Of others it is what
  // the shape space leaves there, by how badly the rays around it fit the carrier, and less beside the
  // former.
  std::vector<float> scale_mm;
  std::vector<StageTime> times;
};

class RayDriver {
 public:
  // Model and avatar must outlive the driver and fit each other.
  RayDriver(const AlignmentModel& model, const SparseViewAvatar& avatar, const RayDriverOptions& options);

  // `frames` have gone by since the last call, one where nothing was missed. Errors of PolishToRays.
  absl::StatusOr<RayDrivenFrame> Drive(double frames, const std::vector<VertexRay>& rays);
  void Reset() { tracker_.Reset(); }
  const TrackMemory& memory() const { return tracker_.memory(); }
  absl::Status Recall(TrackMemory memory) { return tracker_.Recall(std::move(memory)); }

 private:
  std::vector<float> Scales(const RayDrivenFrame& frame, const std::vector<VertexRay>& rays,
                            const std::vector<bool>& rejected) const;

  const AlignmentModel& model_;
  const SparseViewAvatar& avatar_;
  RayDriverOptions options_;
  ViewTracker tracker_;
};

}  // namespace weft
