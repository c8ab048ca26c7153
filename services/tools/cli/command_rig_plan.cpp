// weft rig plan: which cameras a garment needs.
#include <cstdio>
#include <memory>
#include <string>

#include "base/status_macros.h"
#include "services/formats/verdict/verdict.h"
#include "services/ground/process/command_option.h"
#include "services/results/evaluation/plan_rig.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/print_verdict.h"
#include "services/tools/cli/progress.h"
#include "services/tools/cli/remote_operation.h"

namespace weft {
namespace {

struct PlanOptions {
  RigPlanRequest request;
  std::string out;
  int threads = 0;
  bool json = false;
};

absl::Status Plan(const PlanOptions& options, bool quiet) {
  const absl::StatusOr<RigPlanResult> plan = WithBar("plan", quiet, options.threads, [&](const auto& tell) {
    return PlanRigFromFiles(options.request, tell);
  });
  if (!plan.ok()) return plan.status();
  WEFT_RETURN_IF_ERROR(WriteRigPlan(options.out, *plan));
  const v1::Verdict verdict = RigPlanVerdict(*plan);
  if (options.json) {
    WEFT_ASSIGN_OR_RETURN(const std::string json, RigPlanJson(*plan));
    std::fputs(json.c_str(), stdout);
    return VerdictStatus(verdict);
  }
  PrintVerdict(verdict);
  const PlanStep& chosen = plan->steps[plan->rig.cameras.size() - 1];
  std::printf("covered  %.1f %% by the chosen cameras, %.1f %% by all; %.1f views a cell, sigma %.3f mm\n",
              100 * chosen.coverage, 100 * plan->steps.back().coverage, chosen.mean_views,
              chosen.median_sigma_mm);
  std::printf("rig      %s/rig.json\nreport   %s/report.html\n", options.out.c_str(), options.out.c_str());
  return VerdictStatus(verdict);
}

void AddSeeingOptions(CLI::App& command, RigPlanOptions& options) {
  AddOption(command, "--max-facing-deg DEG", options.viewing.max_facing_deg,
            "A cell is seen within this angle", CLI::Range(1.0, 89.0));
  AddOption(command, "--min-pitch-px PX", options.viewing.min_pitch_px,
            "Smallest size of a cell in the picture", CLI::NonNegativeNumber);
  AddOption(command, "--views N", options.views_needed, "Cameras that must see a cell", CLI::Range(2, 100));
  AddOption(command, "--noise-px PX", options.noise_px,
            "Standard deviation of an observation, for the expected sigma", CLI::PositiveNumber);
}

}  // namespace

void AddRigPlanCommand(CLI::App& rig, CommandLine& line) {
  CLI::App* command = AddCommand(
      rig, "plan",
      "Predict what candidate cameras see of a garment in motion (views and pixels per cell, coverage, "
      "expected sigma), and choose among them, each next camera the one that adds most. Writes rig.json of "
      "the chosen cameras, plan.json, and report.html with coverage against the number of cameras, drawings "
      "of the rig and maps on the garment.",
      "  weft rig plan --rig rig.json --template shirt --out plan\n"
      "  weft rig plan --rig rig.json --template take/template --motion take/truth --cameras 24 --out plan");
  auto options = std::make_shared<PlanOptions>();
  RigPlanRequest& request = options->request;
  AddRequired(*command, "--rig FILE", request.rig, "The candidates, rig.json");
  AddRequired(*command, "--template DIR", request.garment, "Folder of the template");
  AddOption(*command, "--motion PATH", request.motion,
            "A mesh.ply, or a folder of <frame>/mesh.ply such as a result or a take's truth; without it the "
            "template as it is");
  AddOption(*command, "--moments N", request.moments, "Frames of the motion to use, spread evenly; 0 for all",
            CLI::NonNegativeNumber);
  AddOption(*command, "--cameras N", request.cameras,
            "Cameras to choose; 0: as few as come within 1 % of what all candidates cover",
            CLI::NonNegativeNumber);
  AddSeeingOptions(*command, request.options);
  AddRequired(*command, "--out DIR", options->out, "Folder for the files, made where it is missing");
  AddOption(*command, "--threads N", options->threads, "Threads; 0 takes all cores", CLI::Range(0, 1024));
  command->add_flag("--json", options->json, "Print JSON (weft.v1.RigPlan)");
  RunHereOrAtDaemon(*command, line, [options, &line] { return Plan(*options, line.quiet); });
}

}  // namespace weft
