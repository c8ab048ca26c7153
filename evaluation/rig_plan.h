// Which cameras a garment needs: what candidates would see of it in motion, and a choice among them.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "alignment/template.h"
#include "capture/rig/rig.h"
#include "evaluation/vertex_views.h"

namespace weft {

struct RigPlanOptions {
  ViewingOptions viewing;
  int views_needed = 3;     // of a vertex, to be triangulated
  double noise_px = 0.15;   // standard deviation per axis of an observation
  int max_cameras = 0;      // of the choice; 0: all that add anything
  int max_samples = 60000;  // vertices with a cell, over all moments, that the choice looks at; spread evenly
  // Weight of the geometry (information of the chosen rays about the points) against the number of views.
  // It decides between cameras of equal coverage.
  double geometry_weight = 0.3;

  absl::Status Validate() const;
};

// The rig after a camera was added.
struct PlanStep {
  int camera = 0;       // of the candidates
  double coverage = 0;  // share of the samples with enough views
  double mean_views = 0;
  double median_sigma_mm =
      0;  // per axis, of the samples with enough views, from pixel noise alone; NaN: none
};

// Greedy selection of cameras, in order. The objective is the sum of capped views and of the log
// determinant of the information about each point. It is monotone and submodular, so the selection is
// within 1 - 1/e of the optimum of its size (Nemhauser et al. 1978). Uses lazy evaluation (Minoux 1978).
// `moments_mm`: the garment's vertices at some moments of its motion, [moments][vertices]. `on_camera`
// (may be empty) is called with the numbers of evaluated candidates and of all, from any thread; calls
// never overlap. Parallel in the calling thread's TBB arena, the same plan at any thread count.
// InvalidArgument: options, no moments, meshes of another number of vertices, a template without cells.
// FailedPrecondition: no candidate sees anything.
absl::StatusOr<std::vector<PlanStep>> PlanRig(const Template& garment,
                                              const std::vector<std::vector<Eigen::Vector3d>>& moments_mm,
                                              const Rig& candidates, const RigPlanOptions& options,
                                              const std::function<void(size_t, size_t)>& on_camera = {});

// What a rig sees of each vertex, [vertices], means over the moments; NaN for vertices without a cell.
struct RigForecast {
  std::vector<double> views;
  std::vector<double> coverage;  // share of the moments with enough views
  std::vector<double> pitch_px;  // of the cell in the views that see it; NaN where none does
  std::vector<double> sigma_mm;  // of the moments with enough views; NaN where there is none
};
absl::StatusOr<RigForecast> ForecastRig(const Template& garment,
                                        const std::vector<std::vector<Eigen::Vector3d>>& moments_mm,
                                        const Rig& rig, const RigPlanOptions& options);

}  // namespace weft
