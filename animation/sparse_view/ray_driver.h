// Registers a garment from rays, frame after frame: shape followed in time, polish, and how far both are off.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/align.h"
#include "animation/avatar/sparse_view_avatar.h"
#include "animation/rays/evidence.h"
#include "animation/rays/ray_polish.h"
#include "animation/sparse_view/view_tracker.h"

namespace weft {

struct RayDriverOptions {
  TrackerOptions tracker;
  PolishOptions polish;
  double corrected_sigma_mm = 150;  // of a vertex that a net corrected, for the second polish

  absl::Status Validate() const;
};

struct StageTime {
  std::string name;  // "track", "polish", ...
  double time_ms = 0;
};

struct RayDrivenFrame {
  GarmentTrack track;
  std::vector<Eigen::Vector3d> carrier_mm, position_mm;  // [vertices]; equal where the frame is lost
  std::vector<Eigen::Vector3d> uncorrected_mm;           // [vertices], before the net; empty without one
  std::vector<int> rays_of_vertex;                       // [vertices], that were not rejected
  std::vector<bool> rejected;                            // [rays]
  int rejected_rays = 0;
  int cameras = 0;  // with rays
  // How far the carrier is from the rays around, over what is usual for frames like those that were learnt,
  // [vertices].
  std::vector<double> misfit;
  // What errors are in proportion to, [vertices]. With two rays and more it is where they cross. Elsewhere it
  // is the misfit times what the shape space leaves, less beside the former, and more where much of the
  // garment has no ray.
  std::vector<float> scale_mm;
  // What the way along the cloth from the nearest vertex with a ray adds to that in quadrature, [vertices]; 0
  // with a ray.
  std::vector<float> growth_mm;
  std::vector<StageTime> times;
};

class NetCorrection;

// What the tracker knows of the frames before, and the mesh that the next polish starts from.
struct RayDriverMemory {
  TrackMemory track;
  // [vertices], the last frame's result in single precision; empty where none is known.
  std::vector<Eigen::Vector3f> mesh_mm;
};

class RayDriver {
 public:
  // Model, avatar and net must outlive the driver and fit each other. `net` may be null: no correction.
  RayDriver(const AlignmentModel& model, const SparseViewAvatar& avatar, const RayDriverOptions& options,
            NetCorrection* net = nullptr);

  // `frames` have gone by since the last call, one where nothing was missed. Errors of PolishToRays and of
  // the net.
  absl::StatusOr<RayDrivenFrame> Drive(double frames, const std::vector<VertexRay>& rays);
  void Reset();
  RayDriverMemory Memory() const { return {tracker_.memory(), last_mm_}; }
  // InvalidArgument: of another garment, or numbers that are not finite; the driver stays as it was.
  absl::Status Restore(RayDriverMemory memory);

 private:
  // The carrier, off by as much as the last frame's was, turned with the garment.
  std::vector<Eigen::Vector3d> StartOf(const RayDrivenFrame& frame, const TrackMemory& before) const;
  absl::Status Correct(const std::vector<VertexRay>& rays, RayDrivenFrame* out);
  void AddScales(const std::vector<VertexRay>& rays, RayDrivenFrame* frame) const;

  const AlignmentModel& model_;
  const SparseViewAvatar& avatar_;
  RayDriverOptions options_;
  NetCorrection* net_;
  ViewTracker tracker_;
  RayPolish polish_;
  std::optional<RayPolish> second_polish_;  // with a net
  double mean_left_mm_ = 0;                 // of the vertices
  std::vector<Eigen::Vector3f> last_mm_;
};

}  // namespace weft
