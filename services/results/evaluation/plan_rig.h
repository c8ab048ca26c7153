// `weft rig plan`: from files to a plan, and a plan to files.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "evaluation/rig_plan.h"
#include "weft/v1/rig_plan.pb.h"
#include "weft/v1/verdict.pb.h"

namespace weft {

struct RigPlanRequest {
  std::string rig;      // the candidates
  std::string garment;  // the template's folder
  std::string motion;   // a mesh.ply, or a folder of <frame>/mesh.ply; empty: the template as it is
  int moments = 8;      // meshes of the folder that are looked at, spread evenly; 0: all
  int cameras = 0;      // to choose; 0: as few as come within 1 % of what all candidates cover
  RigPlanOptions options;
};

struct RigPlanResult {
  Template garment;
  Rig candidates;
  std::vector<std::string> moments;  // names
  RigPlanOptions options;
  std::vector<PlanStep> steps;  // every camera that adds anything
  Rig rig;                      // the first of them
  RigForecast forecast;         // of `rig`
};

// Errors name the file. Parallel in the calling thread's TBB arena. `on_camera`: see PlanRig.
absl::StatusOr<RigPlanResult> PlanRigFromFiles(const RigPlanRequest& request,
                                               const std::function<void(size_t, size_t)>& on_camera = {});

// "3 of 16 cameras cover 93.1 % of the cells".
std::string RigPlanHeadline(const RigPlanResult& plan);
// By the limits of docs/verdicts.md.
v1::Verdict RigPlanVerdict(const RigPlanResult& plan);
v1::RigPlan RigPlanMessage(const RigPlanResult& plan);
// One page that loads nothing: coverage by the number of cameras, the rig from above and from the side, what
// it sees of the garment, the cameras in their order.
std::string MakeRigPlanReport(const RigPlanResult& plan);
// <folder>/{plan.json,rig.json,report.html}; the folder is made where it is missing.
absl::Status WriteRigPlan(const std::string& folder, const RigPlanResult& plan);

}  // namespace weft
