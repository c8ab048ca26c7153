// Drives a garment as Halimi et al. 2022 (section 6) do: a carrier fitted to the views, and a net that sees
// how many pixels each vertex of it is off. No frame knows of another one but as a start of the fit.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/template.h"
#include "animation/atlas/atlas.h"
#include "animation/paper/graph_tracker.h"
#include "animation/paper/pixel_avatar.h"
#include "animation/rays/evidence.h"
#include "nets/net.h"

namespace weft {

// What the net is told of a vertex: for each of the two cameras, in the order of their names, how far the
// cell was found right of and below the carrier's vertex / kPixelUnitPx; 0 where it was not found.
inline constexpr int kPixelCameras = 2, kPixelFeatures = 2 * kPixelCameras;
inline constexpr double kPixelUnitPx = 10;
// What it answers: the offset from the carrier in the world's axes / kAnswerUnitMm of driving_features.h.
inline constexpr int kPixelAnswers = 3;

// [vertices][kPixelFeatures]. `views` are kPixelCameras, in any order; more are passed over.
std::vector<float> PixelFeatures(std::span<const DrivingView> views, const NodeVertices& nodes,
                                 const std::vector<Eigen::Vector3d>& carrier_mm);

struct PixelDrivenFrame {
  bool lost = false;                         // the rest is empty then
  std::vector<Eigen::Vector3d> carrier_mm;   // [vertices]
  std::vector<Eigen::Vector3d> position_mm;  // [vertices]
};

// Not for use by two threads at once.
class PixelDriver {
 public:
  // Errors of PixelAvatar::CheckFits and Validate, CheckNet and Atlas::Build.
  static absl::StatusOr<PixelDriver> Create(const Template& garment, PixelAvatar avatar,
                                            const GraphTrackerOptions& options = {});
  PixelDriver(PixelDriver&&) noexcept;
  PixelDriver& operator=(PixelDriver&&) noexcept;
  ~PixelDriver();

  // InvalidArgument: other than kPixelCameras views; errors of RaysOf and of the net.
  absl::StatusOr<PixelDrivenFrame> Drive(std::span<const DrivingView> views);

 private:
  struct State;
  explicit PixelDriver(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace weft
