// A camera's image with the registered mesh drawn over it.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "alignment/mesh.h"
#include "capture/image/frame.h"
#include "capture/rig/camera_model.h"
#include "services/results/report/job_report.h"

namespace weft {

struct OverlayOptions {
  int width_px = 560, height_px = 560;  // of the picture, at most; small crops are not enlarged
  double margin_share = 0.06;           // of the mesh's extent, around it
  double tint = 0.5;                    // strength of the states' colours, 0 to 1
  int jpeg_quality = 82;
};

// The part of the image in which the mesh is: outlines of what the camera sees of the mesh, black inside and
// white outside, and the colours of states (mesh_colors.h) over all that is not observed by three cameras.
// Where outlines leave the cloth in the image, the mesh is off. `mesh.state`: [vertices]. JPEG.
// InvalidArgument: the frame is no image, or none of the mesh is in it.
absl::StatusOr<MeshPicture> DrawOverlay(const Frame& image, const CameraModel& camera,
                                        const RegisteredMesh& mesh, const std::vector<Face>& faces,
                                        const OverlayOptions& options = {});

}  // namespace weft
