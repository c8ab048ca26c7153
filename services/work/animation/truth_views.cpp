#include "services/work/animation/truth_views.h"

#include <Eigen/Geometry>

#include "alignment/ray_scene.h"
#include "base/status_macros.h"
#include "figure/body.h"
#include "simulation/observation_model.h"
#include "simulation/studio_rig.h"
#include "simulation/take_presets.h"
#include "simulation/view_truth.h"

namespace weft {

TruthViews::TruthViews(const Template& garment, const BodyShape& body)
    : faces_(garment.rest.faces),
      print_(PrintFromVertexNodes(garment.rest.faces, garment.node_of_vertex)),
      body_(body) {}

absl::StatusOr<std::vector<ViewObservations>> TruthViews::Observe(const ClothFrame& frame, const Rig& rig,
                                                                  uint64_t seed) const {
  std::vector<Eigen::Vector3d> all = frame.vertices_mm;
  std::vector<Face> faces = faces_;
  if (frame.pose) {
    const auto first = static_cast<int>(all.size());
    for (const Eigen::Vector3d& v : Body(*frame.pose, body_).MeshVertices()) all.push_back(v);
    for (const Face& face : Body::MeshFaces())
      faces.push_back({face[0] + first, face[1] + first, face[2] + first});
  }
  WEFT_ASSIGN_OR_RETURN(const RayScene rays, RayScene::Build(all, faces));
  const TriangleMesh cloth{frame.vertices_mm, faces_};
  std::vector<ViewObservations> out;
  for (const CameraModel& camera : rig.cameras)
    out.push_back(
        {static_cast<int>(out.size()), ImitateDecoder(FindViewTruth(cloth, print_, rays, camera), seed)});
  return out;
}

absl::StatusOr<Rig> DrivingRig(int cameras, const std::vector<Eigen::Vector3d>& vertices_mm, uint64_t seed,
                               const DrivingPlaces& places) {
  WEFT_ASSIGN_OR_RETURN(const SyntheticTakeOptions preset, SyntheticPreset("shirt-drive", seed));
  StudioRigOptions options = preset.rig;
  options.cameras = cameras;
  options.around_deg = places.arc_deg;
  if (places.distance_mm > 0) options.distance_mm = places.distance_mm;
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& v : vertices_mm) box.extend(v);
  options.aim_mm = box.center();
  return MakeStudioRig("driving", options);
}

}  // namespace weft
