// Follows a garment's place and shape from the rays of a few views: the shape space fitted to them in time.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "alignment/align.h"
#include "animation/rays/evidence.h"
#include "animation/shape/local_shape.h"
#include "animation/shape/shape_space.h"

namespace weft {

struct TrackerOptions {
  int max_rays = 1500;  // evenly spread over the garment
  int min_rays = 60;    // fewer: lost
  // Rays agree that pass their vertex within this share of the garment's size.
  double agreeing_size = 0.04;
  double min_agreeing_share = 0.5;  // less: lost
  double robust_spreads = 3;        // scale of Geman and McClure's function
  // What the space leaves is alike in neighbours: all rays of a view count as so many independent ones.
  double rays_of_view = 70;
  int max_steps = 8;
  LocalShapeOptions local;

  absl::Status Validate() const;
};

struct GarmentTrack {
  ShapeState state;
  double agreeing_share = 0;
  bool started_anew = false;
  bool lost = false;  // `reason` says why; the state is the best guess
  std::string reason;
};

// All that a tracker knows of the frames before: one that recalls it goes on as the one that had it.
struct TrackMemory {
  int known = 0;             // how many of them tell something, up to two
  ShapeState state;          // of the last one
  Eigen::VectorXd z_before;  // of the one before; z of the last one where that alone is known
};

// Minimises, by Gauss-Newton with weights that follow the residuals, the sum over rays of rho(distance /
// spread), plus |z|^2, plus |z_t - 2 z_(t-1) + z_(t-2)|^2 in units of its spread in training; then the same
// with coefficients of each region. It starts from the last frame, and after a loss from each view alone: the
// mean shape's scaled orthographic pose (DeMenthon and Davis 1995) and seven more, turned by 45 degrees each
// about the garment's long axis. No axis of the world plays a part. Deterministic.
class ViewTracker {
 public:
  // `left_mm`: [vertices], per axis, what the space leaves. `acceleration`: [components]. The space and both
  // tables must outlive the tracker.
  ViewTracker(const AlignmentModel& model, const ShapeSpace& space, std::span<const float> left_mm,
              std::span<const float> acceleration, const TrackerOptions& options);

  // `frames` have gone by since the last call, one where nothing was missed. Rays are ordered by vertex.
  GarmentTrack Follow(double frames, const std::vector<VertexRay>& rays);
  std::vector<Eigen::Vector3d> MeshOf(const ShapeState& state) const { return shape_.MeshOf(state); }
  const ShapeRegions& regions() const { return shape_.regions(); }

  void Reset();
  const TrackMemory& memory() const { return memory_; }
  // InvalidArgument: of another space or other regions, or numbers that are not finite.
  absl::Status Restore(TrackMemory memory);

 private:
  struct Fit {
    ShapeState state;
    double cost = 0;  // of the rays, each at most 1
  };
  std::vector<VertexRay> Choose(const std::vector<VertexRay>& rays) const;
  std::vector<Eigen::Isometry3d> Starts(const std::vector<VertexRay>& rays) const;
  std::vector<double> Weigh(const std::vector<VertexRay>& rays, const ShapeState& state, double widening,
                            double* cost) const;
  void Improve(const std::vector<VertexRay>& rays, const ShapePrior& prior, int components, int steps,
               bool with_regions, Fit* fit) const;
  Fit StartAnew(const std::vector<VertexRay>& rays) const;
  double AgreeingShare(const std::vector<VertexRay>& rays, const ShapeState& state) const;

  LocalShape shape_;
  std::span<const float> left_mm_, acceleration_;
  TrackerOptions options_;
  Eigen::Vector3d long_axis_ = Eigen::Vector3d::UnitY();
  double size_mm_ = 0;
  TrackMemory memory_;
};

}  // namespace weft
