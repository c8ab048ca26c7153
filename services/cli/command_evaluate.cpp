// weft evaluate: a job's result against ground truth.
#include <cstdio>
#include <memory>
#include <string>

#include "services/cli/commands.h"
#include "services/cli/progress.h"
#include "services/evaluation/evaluation_text.h"

namespace weft {
namespace {

struct EvaluateOptions {
  std::string result;
  std::string truth;
  bool json = false;
};

absl::Status EvaluateCommand(const EvaluateOptions& options, bool quiet) {
  absl::StatusOr<JobEvaluation> evaluation;
  {
    Progress progress("evaluate", 1, ProgressVisible(quiet));
    evaluation = EvaluateJob(options.result, options.truth, EvaluationOptions(),
                             [&progress](size_t done, size_t all) { progress.Set(done, all); });
  }
  if (!evaluation.ok()) return evaluation.status();
  if (!options.json) {
    std::fputs(EvaluationTable(*evaluation).c_str(), stdout);
    return absl::OkStatus();
  }
  const absl::StatusOr<std::string> json = EvaluationJson(*evaluation);
  if (!json.ok()) return json.status();
  std::fputs(json->c_str(), stdout);
  return absl::OkStatus();
}

}  // namespace

void AddEvaluateCommand(CLI::App& app, CommandLine& line) {
  CLI::App* command = AddCommand(
      app, "evaluate",
      "Measure a job's result against the truth of a synthetic take. Decoding: precision, recall of the "
      "cells "
      "that can be seen well, distance to the true pixel. Cloud: share of the vertices that at least 3 "
      "cameras "
      "see well with a point within 1 mm, error of all points. Mesh: distance of every vertex to its true "
      "place, apart for vertices that at least 3 cameras see well and for all others. Files that the result "
      "lacks are named and not scored.",
      "  weft evaluate result --truth take/truth\n"
      "  weft evaluate result --truth take/truth --json > scores.json");
  auto options = std::make_shared<EvaluateOptions>();
  command->add_option("result", options->result, "The folder that `weft register` wrote")
      ->required()
      ->type_name("DIR");
  command->add_option("--truth", options->truth, "The folder truth of the take")
      ->required()
      ->type_name("DIR");
  command->add_flag("--json", options->json, "Print JSON (weft.v1.Evaluation)");
  command->callback(
      [options, &line] { line.run = [options, &line] { return EvaluateCommand(*options, line.quiet); }; });
}

}  // namespace weft
