// weft rig refine: a rig as its takes show it.
#include <cstdio>
#include <string>

#include "services/formats/verdict/verdict.h"
#include "services/studio/calibration/refine_rig.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/cli/output_guard.h"
#include "services/tools/cli/print_verdict.h"
#include "services/tools/cli/progress.h"

namespace weft {
namespace {

struct RefineOptions {
  RefinementRequest request;
  int threads = 0;
  bool json = false;
  OutputGuard guard;
};

absl::Status Refine(const RefineOptions& options, bool quiet) {
  WEFT_RETURN_IF_ERROR(options.guard.MayReplace(options.request.out, "a rig, which takes may need"));
  const absl::StatusOr<RefinementResult> result =
      WithShareBar("refine", quiet, options.threads,
                   [&](const auto& tell) { return RefineRigFromResult(options.request, tell); });
  if (!result.ok()) return result.status();
  const v1::Verdict verdict = RefinementVerdict(*result);
  const bool is_fit = verdict.grade() != v1::GRADE_BAD;
  const CalibrationRecord* record = result->record ? &*result->record : nullptr;
  if (is_fit) {
    WEFT_RETURN_IF_ERROR(WriteRig(options.request.out, result->rig, result->provenance, record));
  }
  if (options.json) {
    const absl::Status printed = PrintJsonMessage(RefinementReport(*result));
    return printed.ok() ? VerdictStatus(verdict) : printed;
  }
  PrintVerdict(verdict);
  for (const std::string& line : RefinementText(*result)) std::printf("%s\n", line.c_str());
  if (is_fit) {
    std::printf("rig      %s (hash %s)\n", options.request.out.c_str(), result->rig.ContentHash().c_str());
  } else {
    std::printf("rig      %s was not written\n", options.request.out.c_str());
  }
  return VerdictStatus(verdict);
}

}  // namespace

void AddRigRefineCommand(CLI::App& rig, CommandLine& line) {
  const auto [command, options] = AddCommand<RefineOptions>(
      rig, line, Refine, "refine",
      "Correct the poses of a rig by the cloth itself, when a camera was knocked after calibration. Takes "
      "the cells that a registration decoded (weft register --observations), triangulates them anew and "
      "adjusts cameras and cells together. Lenses stay as they were calibrated; world and scale are kept by "
      "the cameras that did not move. Register the take again with the new rig. Where the verdict is bad, as "
      "with exchanged cameras, no rig is written.",
      "  weft rig refine result --rig rig.json --out refined.json\n"
      "  weft rig refine result --rig rig.json --samples 40 --out refined.json --json");
  RefinementRequest& request = options->request;
  AddRequired(*command, "result RESULT", request.result, "What weft register --observations wrote");
  AddRequired(*command, "--rig FILE", request.rig, "The rig.json that the take was registered with");
  AddRequired(*command, "--out FILE", request.out, "The rig.json to write");
  options->guard.AddTo(*command);
  AddOption(*command, "--samples N", request.frames, "At most so many frames, spread over the take",
            CLI::Range(1, 10000));
  command->add_option("--frames", request.frames)
      ->group("")
      ->check(CLI::Range(1, 10000));  // as it was called
  AddOption(*command, "--points N", request.points, "Cells of a frame, spread over the board",
            CLI::Range(100, 100000));
  AddOption(*command, "--sigma-px PX", request.sigma_px,
            "Standard deviation of a decoded cell, where observations.csv lacks it (up to 0.1.2)",
            CLI::PositiveNumber);
  AddOption(*command, "--still-deg DEG", request.solve.still_rotation_deg,
            "How far cameras that did not move may be off in rotation", CLI::PositiveNumber);
  AddOption(*command, "--still-mm MM", request.solve.still_center_mm,
            "Tolerance for the position of cameras that did not move", CLI::PositiveNumber);
  AddOption(*command, "--threads N", options->threads, "Threads; 0 takes all cores", CLI::Range(0, 1024));
  command->add_flag("--json", options->json, "Print JSON (weft.v1.RigRefinementReport)");
}

}  // namespace weft
