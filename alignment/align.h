// Registration of the template to the points of one frame (paper, section 5.4).
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "alignment/elastic_solver.h"
#include "alignment/garment_layers.h"
#include "alignment/hidden_stages.h"
#include "alignment/mesh.h"
#include "alignment/mesh_graph.h"
#include "alignment/ray_targets.h"
#include "alignment/template.h"
#include "alignment/untangle/untangle.h"
#include "triangulation/cloud.h"

namespace weft {

// A position measured for a template vertex.
struct VertexTarget {
  int vertex = -1;
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
  double sigma_mm = 0;  // per axis, 0 where unknown
  int views = 0;
  // Zero where only sigma_mm is known.
  Eigen::Matrix3d covariance_mm2 = Eigen::Matrix3d::Zero();
  // The part of the covariance, or of sigma_mm^2, that folds cause and neighbours share; less than the whole.
  Eigen::Matrix3d fold_covariance_mm2 = Eigen::Matrix3d::Zero();
};

// Points and rays of the cloud that are vertices of the template, cells and corners; `unclaimed` counts the
// cells with a point that are none (corners are vertices of few templates).
struct CloudTargets {
  std::vector<VertexTarget> targets;  // ordered by vertex, a vertex at most once
  std::vector<RayTarget> rays;        // in the cloud's order
  int unclaimed = 0;
};
CloudTargets TargetsFromCloud(const Template& garment, const Cloud& cloud);

// E_Det (paper, Eq. 1): how much each vertex is drawn to its measured or filled position.
struct DetectionOptions {
  // Measured vertices weigh reference_sigma_mm^2 times the inverse of their covariance, or of sigma_mm^2
  // where that alone is known; 1 where the option is off or neither is. What folds cause is left out: it
  // is correlated between neighbours like the gradient of E_Dist, which would only add to it.
  bool weigh_by_sigma = true;
  double reference_sigma_mm = 0.5;
  // Added in quadrature. The first limits every measurement, the second how well a mesh of its cells
  // follows cloth; sigma_mm of the result does not contain the second.
  double min_sigma_mm = 0.01;
  double cloth_sigma_mm = 0.03;
  // Weight of filled vertices. The paper takes 1; the fill is a poor guess, and a weight that merely keeps
  // the system definite leaves the shape of hidden cloth to E_Dist.
  double filled_weight = 0.001;

  absl::Status Validate() const;
};

// Targets that no smooth cloth explains.
struct RobustOptions {
  int max_rounds = 3;  // solves after the first one, each without the outliers of the one before; 0 is off
  // The distance of a target is that to the surface without the target itself. Outliers are further off
  // than this many times the median target, and than min_distance_mm. Targets below the limit are weighted
  // by Tukey's biweight.
  double outlier_ratio = 5;
  double min_distance_mm = 4;

  absl::Status Validate() const;
};

// Vertices without a target beside measured cloth are drawn to where that cloth leads if it goes on as it
// bends (cloth_continuation.h).
struct ContinuationOptions {
  int rings = 3;  // so far from the nearest target; 0 leaves the stage out

  absl::Status Validate() const;
};

// By default least error on hidden cloth; config/paper.txtpb has what the paper does.
struct AlignOptions {
  // Fewer targets than this share of the vertices, or than 3, do not place the template.
  double min_target_share = 0.005;
  DetectionOptions detection;
  ElasticOptions elastic;
  // Weight of bending in a coarse first solve, from which that of `elastic` continues. Stiff cloth finds
  // the wide folds, and soft cloth that starts from them crumples less. 0 skips it.
  double first_bending = 0.2;
  // For cloth that stretches by more than a few percent. Rest edges take the measured length of the cloth
  // around them, smoothed over so many rings of vertices (local_stretch.h). 0 keeps the template's.
  int stretch_rings = 0;
  ContinuationOptions continuation;
  RobustOptions robust;
  // Vertices without a target follow the rays that pass them, without them, nearer than this
  // (ray_targets.h); 0 leaves the stage out.
  double ray_reach_mm = 25;
  // Measured vertices that E_Dist holds further from their points than noise explains go back to them, along
  // folds together (fold_lines.h) and each by itself (return_to_points.h): in standard deviations of the
  // points' noise; 0 leaves them where they are.
  double noise_sigmas = 1.5;
  // Whether measured vertices stay where E_Det + E_Dist left them in the stages after it.
  bool freeze_observed = true;
  PushOptions push;
  ReconOptions recon;
  LayerOptions layers;  // of joint templates
  bool remove_self_intersections = true;
  UntangleOptions untangle;

  absl::Status Validate() const;
};

RayFit RayFitOf(const AlignOptions& options);

// What a frame may bring besides targets.
struct AlignContext {
  const std::vector<RayTarget>* rays = nullptr;  // those of vertices with a target do not count
  const Scan* scan = nullptr;                    // E_Recon
  // Where the vertices were a moment ago, or as another registration has them, [vertices]. Vertices without a
  // target start from there, moved with the targets around them, instead of from a smooth fill.
  const std::vector<Eigen::Vector3d>* start_mm = nullptr;
  CancelCheck cancelled;
  // Called with the vertices after each stage that moves them, from the calling thread.
  std::function<void(const std::string& stage, const std::vector<Eigen::Vector3d>& vertices_mm)> watch;
};

struct StageReport {
  std::string name;
  int iterations = 0;
  double energy_before = 0, energy_after = 0;
  double time_ms = 0;
};

struct AlignResult {
  RegisteredMesh mesh;
  std::vector<StageReport> stages;  // "place", "fill", "rigid_fit", "stiff", "elastic", ...
  UntangleReport untangling;        // all zero where it was not asked for
  int outliers = 0;                 // targets set aside; their vertices are inferred
  int rays = 0;                     // those that the mesh follows
  ScanUse scan;                     // all zero without a scan, or where recon.weight is 0
  std::vector<GarmentPair> layers;  // of a joint template: which garment lies over which, as far as known
  double cloth_scale = 0;  // edges between targets, against the template's: median; 0 where there is none
  double start_turned_deg = 0;  // by which the start was turned to lie as the targets do; 0: it did
};

// What the stages need to know of a template, built once for all frames. Thread safety: const functions may
// be called from any number of threads.
class AlignmentModel {
 public:
  // The mesh must have passed ImportTemplate.
  explicit AlignmentModel(const Template& garment);

  const TriangleMesh& rest() const { return rest_; }
  const MeshGraph& graph() const { return graph_; }
  const SlicedMesh& slices() const { return slices_; }
  const std::vector<GarmentSpan>& garments() const { return garments_; }
  double mean_edge_mm() const { return mean_edge_mm_; }

 private:
  TriangleMesh rest_;
  MeshGraph graph_;
  SlicedMesh slices_;
  std::vector<GarmentSpan> garments_;
  double mean_edge_mm_ = 0;
};

// Stages: rigid placement, Laplacian fill, per-vertex rigid fit, E_Det + lambda E_Dist (Eq. 1 and 2), the
// same without outliers, rays of vertices without a target. With observed vertices fixed follow E_Push and
// E_Recon + lambda E_Dist (Eq. 3 and 4), then the removal of self-intersections. A component of the mesh with
// fewer than three targets follows the placement of the whole template, or stays as context.start_mm has it.
// InvalidArgument for options, targets and starts that are no valid input (named): vertex off the mesh or
// twice, not finite, negative sigma, a start that is the mirror image of the targets, a scan in another unit
// (CheckScanUnit). FailedPrecondition when the targets cannot place the template: too few, all on a line, or
// of another scale (the frame is then reported as failed, never filled with a copy). Cancelled:
// context.cancelled said so. Normals of a scan are turned where they point inwards. Parallel loops run in the
// calling thread's TBB arena; the same result at any thread count.
absl::StatusOr<AlignResult> Align(const AlignmentModel& model, const std::vector<VertexTarget>& targets,
                                  const AlignOptions& options, const AlignContext& context = {});
// For one frame alone.
absl::StatusOr<AlignResult> Align(const Template& garment, const std::vector<VertexTarget>& targets,
                                  const AlignOptions& options, const AlignContext& context = {});

}  // namespace weft
