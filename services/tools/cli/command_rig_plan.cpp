// weft rig plan: which cameras a garment needs.
#include <cstdio>
#include <memory>
#include <string>

#include "services/formats/verdict/verdict.h"
#include "services/results/evaluation/plan_rig.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/cli/kind_options.h"
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
    WEFT_RETURN_IF_ERROR(PrintJsonMessage(RigPlanMessage(*plan)));
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
  KindOptions add(*command, "rig plan");
  add("rig", request.rig);
  add("template", request.garment);
  add("motion", request.motion);
  add("cameras", request.cameras);
  add("views", request.options.views_needed);
  add("moments", request.moments);
  add("max-facing-deg", request.options.viewing.max_facing_deg);
  add("min-pitch-px", request.options.viewing.min_pitch_px);
  add("noise-px", request.options.noise_px);
  AddRequired(*command, "--out DIR", options->out, "Folder for the files, made where it is missing");
  AddOption(*command, "--threads N", options->threads, "Threads; 0 takes all cores", CLI::Range(0, 1024));
  command->add_flag("--json", options->json, "Print JSON (weft.v1.RigPlan)");
  RunHereOrAtDaemon(*command, line, [options, &line] { return Plan(*options, line.quiet); });
}

}  // namespace weft
