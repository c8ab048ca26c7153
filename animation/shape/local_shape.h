// A shape space whose coefficients may differ from place to place, so that parts of a garment can be combined
// as no training frame combined them.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <utility>
#include <vector>

#include "alignment/mesh.h"
#include "alignment/mesh_graph.h"
#include "animation/rays/evidence.h"
#include "animation/shape/shape_space.h"

namespace weft {

struct LocalShapeOptions {
  int regions = 30;  // 0: the space's coefficients hold for the whole garment
  int components = 12;
  double spread = 3;      // of a region's own coefficients, in standard deviations of the space
  double reach_mm = 300;  // over this way along the cloth their correlation falls to 1 / e
  int steps = 3;

  absl::Status Validate() const;
};

// Overlapping regions of the cloth, their middles far from each other.
struct ShapeRegions {
  int count = 0;
  std::vector<std::vector<std::pair<int, double>>> of_vertex;  // [vertices], ordered; weights sum to 1
  Eigen::MatrixXd information;                                 // [count][count], inverse covariance
};
ShapeRegions DivideShape(const TriangleMesh& rest, const MeshGraph& graph, const LocalShapeOptions& options);

// What a garment's place and shape are made of.
struct ShapeState {
  Eigen::Isometry3d root = Eigen::Isometry3d::Identity();  // the world's axes from those of the space
  Eigen::VectorXd z;                                       // [components of the space]
  Eigen::MatrixXd local;  // [regions][components], what a region adds to z; may be empty
};

// (z - expected)^2 information, beside |z|^2.
struct ShapePrior {
  Eigen::VectorXd expected, information;
};

// A space with its regions, laid out for rays.
class LocalShape {
 public:
  // The space must outlive it. Without regions `local` stays empty.
  LocalShape(const ShapeSpace& space, ShapeRegions regions, const LocalShapeOptions& options);

  const ShapeSpace& space() const { return space_; }
  // In the space's axes.
  Eigen::Vector3d PointOf(int vertex, const ShapeState& state) const;
  // The same of the rays' vertices, [rays].
  std::vector<Eigen::Vector3d> PointsOf(const std::vector<VertexRay>& rays, const ShapeState& state) const;
  // In the world's axes, [vertices].
  std::vector<Eigen::Vector3d> MeshOf(const ShapeState& state) const;

  // One Gauss-Newton step of sum weight |(I - d d^T) (x - o)|^2 + |z|^2 + prior + the regions' own, over the
  // root, the first `components` of z and, when `with_regions`, the regions' coefficients; `weight`: [rays].
  // The largest change of a coefficient; negative where the system has no solution and nothing changed.
  double Step(const std::vector<VertexRay>& rays, const std::vector<double>& weight, const ShapePrior& prior,
              int components, bool with_regions, ShapeState* state) const;

  const ShapeRegions& regions() const { return regions_; }
  int local_components() const { return options_.components; }

 private:
  // The coefficients at a vertex.
  void CoefficientsAt(int vertex, const ShapeState& state, Eigen::VectorXd* z) const;
  Eigen::Vector3d PointAt(int vertex, const Eigen::VectorXd& z) const;

  // The regions' part of the normal equations; `common` and `residual` as Step has them.
  void AddRegions(const std::vector<VertexRay>& rays, const Eigen::MatrixXd& common,
                  const Eigen::VectorXd& residual, Eigen::MatrixXd* normal, Eigen::VectorXd* right) const;

  // sigma times basis of a vertex, [3][components].
  Eigen::Map<const Eigen::Matrix3Xf> WaysOf(int vertex) const {
    return {ways_.data() + 3 * static_cast<size_t>(vertex) * space_.sigma_mm.size(), 3, space_.components()};
  }

  const ShapeSpace& space_;
  ShapeRegions regions_;
  LocalShapeOptions options_;
  std::vector<float> ways_;  // [vertices][components][3]
};

}  // namespace weft
