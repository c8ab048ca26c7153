// What a camera sees of a mesh, vertex by vertex.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/status.h"
#include "alignment/mesh.h"
#include "alignment/ray_scene.h"
#include "alignment/template.h"
#include "capture/rig/camera_model.h"
#include "pattern/observation.h"

namespace weft {

struct ViewingOptions {
  double max_facing_deg = 65;  // between the outward normal and the direction to the camera
  double min_pitch_px = 3;     // of a cell in the picture, foreshortened
  double clearance_mm = 0.5;   // how near to itself a surface does not hide

  absl::Status Validate() const;
};

struct VertexView {
  bool seen = false;   // in the picture, facing the camera, large enough, nothing before it
  float pitch_px = 0;  // square root of the area of the projected cell; of seen vertices
  float facing_cosine = 0;
};

// A mesh at one moment, ready to be looked at. Immutable; any number of threads may look at once.
class VisibleMesh {
 public:
  // Errors of RayScene::Build. Embree's tree is built on the calling thread.
  static absl::StatusOr<VisibleMesh> Build(std::vector<Eigen::Vector3d> vertices_mm,
                                           const std::vector<Face>& faces, double cell_mm);

  const std::vector<Eigen::Vector3d>& vertices_mm() const { return vertices_mm_; }

  VertexView Observe(int vertex, const CameraModel& camera, const ViewingOptions& options) const;
  // All vertices; parallel in the calling thread's TBB arena.
  std::vector<VertexView> Observe(const CameraModel& camera, const ViewingOptions& options) const;

 private:
  std::vector<Eigen::Vector3d> vertices_mm_;
  std::vector<Eigen::Vector3d> normals_;
  double cell_mm_ = 0;
  RayScene rays_;
};

// [vertices] Whether a picture was read around a vertex: most of the 3x3 cells around its own were decoded,
// or of the four around its corner. Where the mesh alone says that a camera sees cloth but little of it was
// read, something that is no part of the mesh covers it, such as a hand.
std::vector<bool> ReadAround(const std::vector<VertexNode>& node_of_vertex,
                             const std::vector<Observation>& observations);

// Pitch of the template's cells at rest: the square root of the area of the printed faces by that of their
// cells. 0 when no face is printed.
double CellPitchMm(const Template& garment);

}  // namespace weft
