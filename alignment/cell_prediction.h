// Where the cells of a registered mesh must be in a view.
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "alignment/mesh.h"
#include "alignment/ray_scene.h"
#include "alignment/template.h"
#include "capture/rig/camera_model.h"
#include "pattern/fit/cell.h"

namespace weft {

struct PredictionOptions {
  double max_facing_deg = 82;  // between the surface's normal and the direction to the camera

  absl::Status Validate() const;
};

// The 3x3 cells around each vertex as vertices, row by row, itself in the middle. -1 where there is no
// cell or a seam lies between. Vertices without a cell have none.
using CellNeighborhood = std::array<int, 9>;
std::vector<CellNeighborhood> FindCellNeighborhoods(const Template& garment);

struct CellInView {
  int vertex = -1;
  PredictedCell cell;
};

// A registered mesh, prepared for projection into any camera. Immutable; any number of threads may use it
// at once. `garment` and `neighborhoods` must outlive it.
class PredictedSurface {
 public:
  // Errors of RayScene::Build; InvalidArgument where the mesh is no mesh of the template.
  static absl::StatusOr<PredictedSurface> Build(const Template& garment,
                                                const std::vector<CellNeighborhood>& neighborhoods,
                                                const RegisteredMesh& mesh, const PredictionOptions& options);

  // The cells that the camera sees, ordered by vertex: in the picture, facing the camera, nothing before
  // them. The pose of a cell is that of the mesh around its vertex; cells without neighbours in both
  // directions of the board are left out. sigma_px is the vertex's sigma_mm, projected.
  std::vector<CellInView> CellsIn(const CameraModel& camera) const;

 private:
  const Template* garment_ = nullptr;
  const std::vector<CellNeighborhood>* neighborhoods_ = nullptr;
  std::vector<Eigen::Vector3d> vertices_mm_;
  std::vector<float> sigma_mm_;
  RayScene rays_;
  double clearance_mm_ = 0;
  double min_facing_cosine_ = 0;
};

}  // namespace weft
