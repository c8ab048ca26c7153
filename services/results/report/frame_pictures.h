// Pictures of registered meshes for the report.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "services/results/report/job_report.h"
#include "services/results/report/mesh_view.h"

namespace weft {

// A frame to be pictured.
struct PicturedMesh {
  std::string frame;
  std::string why_shown;
  RegisteredMesh mesh;
  std::vector<Face> faces;
};

// Front and back of every mesh by state and by sigma. All share the viewpoint of the first mesh and one
// range of sigma (of the observed vertices), so that frames are comparable. World up is -y. Meshes that
// cannot be drawn are left out, with a line in `notes`.
std::vector<FramePictures> DrawFrames(const std::vector<PicturedMesh>& meshes,
                                      std::vector<std::string>& notes);

// Both broad sides of a mesh. Errors of RenderMesh.
absl::StatusOr<std::vector<MeshPicture>> DrawBothSides(const TriangleMesh& mesh,
                                                       const std::vector<Eigen::Vector3f>& colors,
                                                       double shading);

}  // namespace weft
