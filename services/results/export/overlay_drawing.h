// A registered mesh drawn over the picture of a camera.
#pragma once

#include <Eigen/Core>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/mesh.h"
#include "capture/image/frame.h"
#include "capture/rig/camera_model.h"

namespace weft {

enum class OverlayKind {
  kWireframe,  // edges
  kState,      // faces by the state of their vertices
  kSigma,      // faces by the standard deviation of their vertices
  kNone,       // nothing: the picture alone
};

// "wireframe", "state", "sigma", "none". InvalidArgument lists them.
absl::StatusOr<OverlayKind> OverlayKindFromName(std::string_view name);
const char* NameOf(OverlayKind kind);

// What of a mesh is drawn, in the rig's world.
struct OverlayMesh {
  std::vector<Eigen::Vector3d> vertices_mm;
  std::vector<Face> faces;
  std::vector<Eigen::Vector3f> colors;  // [vertices], sRGB from 0 to 1
};

// The picture in colour, with the part of the mesh over it that the camera sees: outsides of faces that
// nothing of the mesh hides, with the lens's distortion. InvalidArgument: no picture, or a mesh that is none.
absl::StatusOr<Frame> DrawOverlay(const Frame& picture, const OverlayMesh& mesh, const CameraModel& camera,
                                  OverlayKind kind);

}  // namespace weft
