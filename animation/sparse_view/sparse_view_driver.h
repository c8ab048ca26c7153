// Registers a garment from a few cameras, frame after frame, with what its avatar learnt.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "alignment/mesh.h"
#include "alignment/template.h"
#include "animation/avatar/sparse_view_avatar.h"
#include "animation/rays/evidence.h"
#include "animation/sparse_view/ray_driver.h"
#include "triangulation/camera_bias.h"

namespace weft {

struct SparseViewOptions {
  // Added to the sigma of each observation, in quadrature. Chosen as the numbers of IsometricOptions, with
  // --cloth-sigma: 0.3 costs a tenth.
  double cloth_sigma_px = 0.1;
  RayDriverOptions driver;

  absl::Status Validate() const;
};

struct DrivenFrame {
  // All vertices, with states kDriven (no ray, or one), kTwoView and kObserved by the number of their rays.
  // sigma_mm is the distance from the truth that about 68 % of the vertices keep; 95 % keep twice that. A
  // camera whose picture the garment is leaving counts for it as what it sees.
  RegisteredMesh mesh;
  // The mesh is a guess that must not be used; `reason` says why, in words for people. The driver starts
  // anew at the next frame.
  bool lost = false;
  std::string reason;
  bool started_anew = false;      // the garment was looked for without regard to the frame before
  int rays = 0;                   // observations of vertices, in all views
  int rejected_rays = 0;          // of them, set aside because they disagree with the cloth around them
  std::vector<int> rays_of_view;  // [views]
  // [views]: where the view sees the cloth, from where the carrier has it. The shape gives way to a camera
  // that stands elsewhere than its calibration says, and what is left has one direction in all frames.
  std::vector<CameraBias> bias_of_view;
  double residual_px = 0;                       // median distance of the rays' vertices from their pixels
  std::vector<Eigen::Vector3d> carrier_mm;      // [vertices], the shape before the polish
  std::vector<Eigen::Vector3d> uncorrected_mm;  // [vertices], without the net; empty without one
  std::vector<StageTime> times;
};

// All that a driver knows of the frames so far.
struct DriverMemory {
  std::optional<int64_t> last_ns;  // the time of the last one; empty before the first
  RayDriverMemory drive;
};

// Follows one garment in time. Not for use by two threads at once; parallel loops run in the calling thread's
// TBB arena. The same frames in the same order give the same bytes at any thread count.
class SparseViewDriver {
 public:
  // FailedPrecondition, with both names, where the avatar is of another template or board; InvalidArgument
  // for options and avatars that are not valid.
  static absl::StatusOr<SparseViewDriver> Create(const Template& garment, SparseViewAvatar avatar,
                                                 const SparseViewOptions& options = {});
  SparseViewDriver(SparseViewDriver&&) noexcept;
  SparseViewDriver& operator=(SparseViewDriver&&) noexcept;
  ~SparseViewDriver();

  // The next frame. Views may differ from frame to frame in number and place; a camera that saw nothing may
  // be left out or come without observations. What is seen too little of gives a frame that is `lost`, not
  // an error. InvalidArgument: no views, a camera twice or not valid, an observation that is not finite, a
  // time that is not after the last frame's.
  absl::StatusOr<DrivenFrame> Drive(int64_t time_ns, std::span<const DrivingView> views);

  // Forgets the frames so far.
  void Reset();

  DriverMemory Memory() const;
  // Goes on as the driver whose memory this is, to the same bytes. InvalidArgument: of another avatar or with
  // other options; the driver stays as it was.
  absl::Status Restore(DriverMemory memory);

 private:
  struct State;
  explicit SparseViewDriver(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace weft
