#include "services/results/evaluation/plan_rig.h"

#include <cmath>
#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/frame_folders.h"
#include "services/formats/files/frame_paths.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/files/rig_file.h"
#include "services/formats/files/template_file.h"
#include "services/formats/verdict/verdict.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

// Coverage this near to that of all candidates is as good.
constexpr double kEnough = 0.99;

struct NamedMoments {
  std::vector<std::string> names;
  std::vector<std::vector<Eigen::Vector3d>> positions_mm;
};

absl::StatusOr<NamedMoments> ReadMoments(const RigPlanRequest& request, const Template& garment) {
  NamedMoments out;
  if (request.motion.empty()) return NamedMoments{{"template"}, {garment.rest.vertices_mm}};
  std::vector<std::pair<std::string, std::string>> files;  // name and path
  if (!IsFolder(request.motion)) {
    files.emplace_back(fs::path(request.motion).filename().string(), request.motion);
  } else {
    WEFT_ASSIGN_OR_RETURN(const std::vector<std::string> names, ListFrameFolders(request.motion));
    if (names.empty())
      return absl::NotFoundError(absl::StrCat(request.motion, ": holds no <frame>/mesh.ply"));
    const size_t count =
        request.moments == 0 ? names.size() : std::min(names.size(), static_cast<size_t>(request.moments));
    for (size_t i = 0; i < count; ++i) {
      const std::string& name = names[(2 * i + 1) * names.size() / (2 * count)];
      files.emplace_back(name, FramePaths(request.motion, name).Of(FrameFile::kMesh));
    }
  }
  for (const auto& [name, path] : files) {
    WEFT_ASSIGN_OR_RETURN(TriangleMesh mesh, ReadMesh(path));
    if (mesh.vertices_mm.size() != garment.rest.vertices_mm.size())
      return absl::InvalidArgumentError(absl::StrCat(path, ": has ", mesh.vertices_mm.size(),
                                                     " vertices, the template ",
                                                     garment.rest.vertices_mm.size()));
    out.names.push_back(name);
    out.positions_mm.push_back(std::move(mesh.vertices_mm));
  }
  return out;
}

size_t ChosenCount(const RigPlanRequest& request, const std::vector<PlanStep>& steps) {
  if (request.cameras > 0) return std::min(steps.size(), static_cast<size_t>(request.cameras));
  for (size_t i = 0; i < steps.size(); ++i)
    if (steps[i].coverage > 0 && steps[i].coverage >= kEnough * steps.back().coverage) return i + 1;
  return steps.size();
}

}  // namespace

absl::StatusOr<RigPlanResult> PlanRigFromFiles(const RigPlanRequest& request,
                                               const std::function<void(size_t, size_t)>& on_camera) {
  RigPlanResult out;
  out.options = request.options;
  WEFT_ASSIGN_OR_RETURN(out.candidates, ReadRig(request.rig));
  WEFT_ASSIGN_OR_RETURN(out.garment, ReadTemplate(request.garment));
  WEFT_ASSIGN_OR_RETURN(NamedMoments moments, ReadMoments(request, out.garment));
  out.moments = moments.names;
  WEFT_ASSIGN_OR_RETURN(
      out.steps, PlanRig(out.garment, moments.positions_mm, out.candidates, request.options, on_camera));
  out.rig.id = out.candidates.id;
  const size_t chosen = ChosenCount(request, out.steps);
  for (size_t i = 0; i < chosen; ++i) out.rig.cameras.push_back(out.candidates.cameras[out.steps[i].camera]);
  WEFT_ASSIGN_OR_RETURN(out.forecast,
                        ForecastRig(out.garment, moments.positions_mm, out.rig, request.options));
  return out;
}

std::string RigPlanHeadline(const RigPlanResult& plan) {
  const size_t chosen = plan.rig.cameras.size();
  return absl::StrFormat("%d of %d cameras cover %.1f %% of the cells", chosen,
                         plan.candidates.cameras.size(), 100 * plan.steps[chosen - 1].coverage);
}

v1::Verdict RigPlanVerdict(const RigPlanResult& plan) {
  v1::Verdict verdict;
  AddFinding(verdict, v1::GRADE_GOOD, RigPlanHeadline(plan), "");
  AddCheck(verdict, kPlanCoverage, 100 * plan.steps[plan.rig.cameras.size() - 1].coverage);
  return verdict;
}

v1::RigPlan RigPlanMessage(const RigPlanResult& plan) {
  v1::RigPlan out;
  out.set_template_hash(plan.garment.ContentHash());
  out.set_candidates_hash(plan.candidates.ContentHash());
  out.set_candidates(static_cast<uint32_t>(plan.candidates.cameras.size()));
  for (const std::string& name : plan.moments) out.add_moments(name);
  out.set_max_facing_deg(plan.options.viewing.max_facing_deg);
  out.set_min_pitch_px(plan.options.viewing.min_pitch_px);
  out.set_views_needed(static_cast<uint32_t>(plan.options.views_needed));
  out.set_noise_px(plan.options.noise_px);
  for (const PlanStep& step : plan.steps) {
    v1::RigPlanStep& added = *out.add_steps();
    added.set_camera(plan.candidates.cameras[step.camera].id);
    added.set_coverage(step.coverage);
    added.set_mean_views(step.mean_views);
    if (!std::isnan(step.median_sigma_mm)) added.set_median_sigma_mm(step.median_sigma_mm);
  }
  out.set_chosen(static_cast<uint32_t>(plan.rig.cameras.size()));
  out.set_rig_hash(plan.rig.ContentHash());
  *out.mutable_verdict() = RigPlanVerdict(plan);
  return out;
}

absl::Status WriteRigPlan(const std::string& folder, const RigPlanResult& plan) {
  WEFT_ASSIGN_OR_RETURN(const std::string json, ToJson(RigPlanMessage(plan)));
  absl::Status status = CreateFolders(folder);
  if (status.ok())
    status = WriteRig((fs::path(folder) / "rig.json").string(), plan.rig,
                      absl::StrCat("chosen by weft rig plan from rig ", plan.candidates.ContentHash()));
  if (status.ok()) status = WriteFileAtomically((fs::path(folder) / "plan.json").string(), json);
  if (status.ok())
    status = WriteFileAtomically((fs::path(folder) / "report.html").string(), MakeRigPlanReport(plan));
  return status;
}

}  // namespace weft
