// Registration of the template to the points of one frame (paper, section 5.4).
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "alignment/mesh.h"
#include "alignment/template.h"
#include "triangulation/cloud.h"

namespace weft {

// A position measured for a template vertex.
struct VertexTarget {
  int vertex = -1;
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
  double sigma_mm = 0;
  int views = 0;
};

// The centres of the cloud that belong to the template; `unclaimed` counts those whose cell no vertex has.
struct CloudTargets {
  std::vector<VertexTarget> targets;  // ordered by vertex, a vertex at most once
  int unclaimed = 0;
};
CloudTargets TargetsFromCloud(const Template& garment, const Cloud& cloud);

struct AlignOptions {
  absl::Status Validate() const;
};
AlignOptions PaperPreset();
AlignOptions BestPreset();

struct StageReport {
  std::string name;
  int iterations = 0;
  double energy_before = 0, energy_after = 0;
  double time_ms = 0;
};

struct AlignResult {
  RegisteredMesh mesh;
  std::vector<StageReport> stages;
};

// FailedPrecondition when there are too few targets to place the template (the frame is then reported as
// failed, never filled with a copy). Parallel loops run in the calling thread's TBB arena; the same result at
// any thread count.
absl::StatusOr<AlignResult> Align(const Template& garment, const std::vector<VertexTarget>& targets,
                                  const AlignOptions& options);

}  // namespace weft
