// weft evaluate: how good a job's result is.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "services/formats/verdict/verdict.h"
#include "services/results/evaluation/comparison_report.h"
#include "services/results/evaluation/comparison_text.h"
#include "services/results/evaluation/evaluation_report.h"
#include "services/results/evaluation/evaluation_text.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/evaluate_avatar.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/cli/kind_options.h"
#include "services/tools/cli/print_verdict.h"
#include "services/tools/cli/progress.h"
#include "services/tools/cli/remote_operation.h"

namespace weft {
namespace {

struct EvaluateOptions {
  EvaluationRequest request;
  std::string against, against_rig, against_garment;
  EvaluateAvatarOptions avatar;
  std::string out;
  int threads = 0;
  bool json = false;
};

// As JSON, or as a table with the place of the report.
absl::Status PrintMeasures(const EvaluateOptions& options, const google::protobuf::Message& message,
                           const std::string& table) {
  WEFT_RETURN_IF_ERROR(PrintMessage(message, options.json, table));
  if (!options.json && !options.out.empty()) std::printf("report   %s/report.html\n", options.out.c_str());
  return absl::OkStatus();
}

absl::Status EvaluateCommand(const EvaluateOptions& options, bool quiet) {
  WEFT_ASSIGN_OR_RETURN(const JobEvaluation evaluation,
                        WithBar("evaluate", quiet, options.threads,
                                [&](const auto& tell) { return EvaluateJob(options.request, tell); }));
  if (!options.out.empty()) WEFT_RETURN_IF_ERROR(WriteEvaluation(options.out, evaluation));
  if (!options.json) PrintVerdict(evaluation.verdict);
  WEFT_RETURN_IF_ERROR(
      PrintMeasures(options, EvaluationMessage(evaluation), absl::StrCat("\n", EvaluationTable(evaluation))));
  return VerdictStatus(evaluation.verdict);
}

absl::Status CompareCommand(const EvaluateOptions& options, bool quiet) {
  const auto compare = [&](const auto& tell) {
    return CompareJobs({options.request, options.against, options.against_rig, options.against_garment},
                       tell);
  };
  WEFT_ASSIGN_OR_RETURN(const JobComparison comparison, WithBar("compare", quiet, options.threads, compare));
  if (!options.out.empty()) WEFT_RETURN_IF_ERROR(WriteComparison(options.out, comparison));
  return PrintMeasures(options, ComparisonMessage(comparison), ComparisonTable(comparison));
}

// Avatars come from others.
std::optional<ConfinedFiles> EvaluatedFilesOf(const EvaluateOptions& options) {
  const AvatarScoring& scoring = options.avatar.scoring;
  if (scoring.avatar.empty()) return std::nullopt;
  return ConfinedFiles{
      .readable = {scoring.avatar, scoring.baseline, options.request.result, options.request.garment},
      .writable = {options.out, scoring.meshes}};
}

absl::Status EvaluateAvatarCommand(const EvaluateOptions& options, bool quiet) {
  EvaluateAvatarOptions avatar = options.avatar;
  avatar.scoring.sources = {options.request.result};
  avatar.scoring.garment = options.request.garment;
  avatar.scoring.fps = options.request.fps;
  avatar.scoring.threads = std::max(1, options.threads);
  avatar.out = options.out;
  avatar.json = options.json;
  return EvaluateAvatar(avatar, quiet);
}

// Its report.html and tables would take the place of the job's.
absl::Status CheckOutIsNoResult(const EvaluateOptions& options) {
  std::error_code error;
  for (const std::string& result : {options.request.result, options.against}) {
    if (options.out.empty() || !std::filesystem::equivalent(options.out, result, error)) continue;
    return absl::InvalidArgumentError(absl::StrCat(
        "--out ", options.out,
        ": is the result itself, whose report.html would be replaced; give a folder of its own, ",
        options.out, "/evaluation"));
  }
  return absl::OkStatus();
}

}  // namespace

void AddEvaluateCommand(CLI::App& app, CommandLine& line) {
  CLI::App* command = AddCommand(
      app, "evaluate",
      "Measure a job's result, against the truth of a synthetic take where there is one. With a truth: "
      "precision and recall of decoding, error of the cloud, distance of every vertex to its true position "
      "(apart for vertices that 3 cameras or more see and for all others; where the template is not that of "
      "the take, by board cell), exact drift. Without: coverage and visibility, correspondence drift by "
      "optical flow between unwrapped textures, geodesic distortion against the template, "
      "self-intersections, jitter, reprojection and leave-one-camera-out error of every camera. What cannot "
      "be measured is named with the reason. The verdict comes first; bad is exit status 1. With --out: "
      "evaluation.json, frames.csv, cameras.csv and report.html. With --against: both results side by side, "
      "frame by frame; every difference with its standard error and the probability that it is chance. Then "
      "--out has comparison.json, tables as CSV, plots and maps as SVG, and report.html. With --avatar: how "
      "well a garment's avatar follows it before few cameras, on takes whose truth is known. The carrier "
      "(its shape before it is polished) and the best that its shapes can do stand beside it.",
      "  weft evaluate result --out result/evaluation\n"
      "  weft evaluate best --against paper --quick --out comparison\n"
      "  weft evaluate result --truth take/truth --quick\n"
      "  weft evaluate result --truth take/truth --json > scores.json\n"
      "  weft evaluate shirt-drive --avatar shirt.avatar --cameras 2,3");
  auto options = std::make_shared<EvaluateOptions>();
  EvaluationRequest& request = options->request;
  KindOptions add(*command, "evaluate");
  add("result", request.result);
  add("truth", request.truth);
  add("no-truth", request.no_truth);
  add("take", request.dump);
  add("rig", request.rig);
  add("template", request.garment);
  add("fps", request.fps);
  add("samples", request.samples);
  add("sources", request.geodesics.sources);
  add("seed", request.geodesics.seed);
  add("quick", request.quick);
  add("against", options->against);
  add("against-rig", options->against_rig);
  add("against-template", options->against_garment);
  command->get_option("--no-truth")->excludes("--truth");
  for (const char* of_the_other : {"--against-rig", "--against-template"})
    command->get_option(of_the_other)->needs("--against");
  AddEvaluateAvatarOptions(*command, options->avatar);
  command->get_option("--avatar")->excludes("--against");
  AddOption(*command, "--out DIR", options->out, "Folder for report and tables, made where it is missing");
  AddOption(*command, "--threads N", options->threads, "Threads; 0 takes all cores", CLI::Range(0, 1024));
  command->add_flag("--json", options->json,
                    "Print JSON (weft.v1.Evaluation; with --against weft.v1.Comparison)");
  const auto here = [options, &line] {
    WEFT_RETURN_IF_ERROR(CheckOutIsNoResult(*options));
    if (!options->avatar.scoring.avatar.empty()) return EvaluateAvatarCommand(*options, line.quiet);
    return options->against.empty() ? EvaluateCommand(*options, line.quiet)
                                    : CompareCommand(*options, line.quiet);
  };
  RunHereOrAtDaemon(*command, line, here, [options] { return EvaluatedFilesOf(*options); });
}

}  // namespace weft
