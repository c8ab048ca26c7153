// weft split: the result of a take with several garments, each by itself.
#include <cstdio>
#include <string>

#include "services/ground/process/stop_on_signal.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/progress.h"
#include "services/work/job/split_job.h"

namespace weft {
namespace {

struct SplitOptions {
  std::string result;
  std::string out;
};

absl::Status Split(const SplitOptions& options) {
  const StopOnSignal stop;
  WEFT_ASSIGN_OR_RETURN(const std::vector<SplitGarment> garments,
                        WithBar("split", false, 0, [&](const auto& tell) {
                          return SplitJob(options.result, options.out, tell, stop.token());
                        }));
  for (const SplitGarment& one : garments)
    std::printf("%s: %d frames of %s\n", one.result.c_str(), one.frames, one.id.c_str());
  return absl::OkStatus();
}

}  // namespace

void AddSplitCommand(CLI::App& app, CommandLine& line) {
  const auto [command, options] = AddCommand<SplitOptions>(
      app, line, Split, "split",
      "Take the result of a joint template apart: DIR/GARMENT is a result of each garment by itself, with "
      "its own template, which weft evaluate, export and the Blender add-on read like any other.",
      "  weft split result --out garments\n  weft evaluate garments/shirt");
  AddRequired(*command, "RESULT", options->result, "The --out folder of weft register");
  AddRequired(*command, "--out DIR", options->out, "Folder to write to");
}

}  // namespace weft
