// Whether the cameras agree with each other, and whose place a camera has that agrees with no other.
#pragma once

#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/rig/exchange_cameras.h"
#include "triangulation/triangulate.h"

namespace weft {

// How images may lie the wrong way round.
enum class ImageTurn { kNone, kUpsideDown, kMirrored, kMirroredUpsideDown };

// A camera of the rig whose model explains what another one saw.
struct CameraPlace {
  int camera = 0;  // of the rig; the camera itself where only its images are turned
  ImageTurn turn = ImageTurn::kNone;
  double median_px = 0;                   // residual there
  CameraPart part = CameraPart::kCamera;  // what is the other's; no kCamera where sizes of images differ
};

// One camera against the points that three or more others agree on.
struct CameraAgreement {
  int compared = 0;      // observations of such nodes that were looked at
  int agreeing = 0;      // of them, those within kAgreementPx of the point
  double median_px = 0;  // distance from the point
  // What the offsets of cells near each other have in common: noise of single cells has no part in it, poses,
  // lenses and images of another moment do. 0 where too little tells.
  double common_px = 0;
  // Size of what it sees against what the others say, about the middle; 0 where too little tells.
  double scale = 0;
  double scale_sigma = 0;
  // By how much near cloth is larger against far cloth than the points say, by the ratio of depths. Points of
  // focal lengths that are all too short by a share are larger by it, in depth as well: then it is minus
  // that share. A rig of another scale leaves no trace in it.
  double perspective = 0;
  double perspective_sigma = 0;
  std::optional<CameraPlace> fits;  // where the camera disagrees and another place explains it
};

// A camera that was knocked sees the cloth up to so far off; one that is further off stands elsewhere.
inline constexpr double kAgreementPx = 20;

// One entry per camera of the rig; `options` are those that the cloud was made with. Only where a camera
// disagrees by more than a pixel are places and lenses of the others tried on its observations, and its
// images turned. Where the rays of most nodes do not meet, no point says who is wrong: then exchanges of two
// cameras are tried, one after the other, until the rays meet. Rigs of more than 40 cameras are not searched
// so. InvalidArgument: options; a view of a camera that the rig lacks.
absl::StatusOr<std::vector<CameraAgreement>> MeasureCameraAgreement(
    const Rig& rig, const std::vector<ViewObservations>& views, const Cloud& cloud,
    const TriangulationOptions& options);

// The same from about 2,000 of the nodes, triangulated for this alone.
absl::StatusOr<std::vector<CameraAgreement>> MeasureSampledAgreement(
    const Rig& rig, const std::vector<ViewObservations>& views, const TriangulationOptions& options);

}  // namespace weft
