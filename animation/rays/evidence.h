// What views say about vertices: the rays on which they lie, of any number of cameras in any place.
#pragma once

#include <Eigen/Core>
#include <span>
#include <unordered_map>
#include <vector>

#include "absl/status/statusor.h"
#include "alignment/template.h"
#include "capture/rig/camera_model.h"
#include "pattern/observation.h"

namespace weft {

// What the decoder made of one picture. Cells that are no vertex of the template are passed over.
struct DrivingView {
  const CameraModel* camera = nullptr;
  std::span<const Observation> observations;
};

// A ray on which a vertex was seen.
struct VertexRay {
  int vertex = -1;
  int view = -1;  // of the views in the order of their cameras' names
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  // of length 1
  double sigma_rad = 0;  // standard deviation of the direction, across the ray
  double focal_px = 1;   // of its camera

  // From a point to the nearest one of the ray.
  Eigen::Vector3d OffsetTo(const Eigen::Vector3d& point_mm) const {
    const Eigen::Vector3d way = origin_mm - point_mm;
    return way - direction * direction.dot(way);
  }
  // Standard deviation at the point's distance from the camera.
  double SigmaMm(const Eigen::Vector3d& point_mm) const { return sigma_rad * (point_mm - origin_mm).norm(); }
};

// Which vertex a node of the board is.
class NodeVertices {
 public:
  explicit NodeVertices(const Template& garment);
  int VertexOf(const BoardNode& node) const;  // -1: none

 private:
  static uint64_t Key(int row, int col, NodeKind kind);
  std::unordered_map<uint64_t, int> vertex_;
};

// The rays of all views, ordered by vertex, then by the name of the camera, so that the order of the views
// does not matter. `cloth_sigma_px` is added to each observation's sigma in quadrature. Of two observations
// of a node in one view the more confident one counts; pixels in which the lens model has no inverse are left
// out. InvalidArgument: a view without camera, a camera twice or not valid, an observation that is not
// finite or has a negative sigma.
absl::StatusOr<std::vector<VertexRay>> RaysOf(std::span<const DrivingView> views, const NodeVertices& nodes,
                                              double cloth_sigma_px);

// For each view as it was given, its place in the order of the cameras' names: VertexRay::view.
std::vector<int> PlacesByName(std::span<const DrivingView> views);

// Normal equations of a vertex: the sum over its rays of weight |(I - d d^T) (x - o)|^2 is
// x^T information x - 2 moment^T x + const.
struct RayEvidence {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();  // 1/mm^2
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();       // 1/mm
  int rays = 0;

  // `weight` multiplies 1 / (the ray's sigma at `near_mm`)^2.
  void Add(const VertexRay& ray, const Eigen::Vector3d& near_mm, double weight);
};

// Fits to rays begin with a robust function so many times wider, so that limbs that moved far are not taken
// for errors.
inline double WideningAt(int step) { return step == 0 ? 4 : step == 1 ? 2 : 1; }
// Median of the length of a normal vector across a ray, in standard deviations of an axis.
inline constexpr double kMedianAcross = 1.177;

// Geman and McClure's weight of a residual that is `ratio` times its scale: 1 at 0, a quarter at the scale,
// falling with the fourth power beyond it.
inline double GemanMcClureWeight(double ratio) { return 1 / ((1 + ratio * ratio) * (1 + ratio * ratio)); }

}  // namespace weft
