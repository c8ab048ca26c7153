// weft take sync: did the cameras of a take keep together?
#include <string>

#include "services/formats/files/atomic_file.h"
#include "services/formats/verdict/verdict.h"
#include "services/studio/recording/sync_report.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/cli/sync_page.h"

namespace weft {
namespace {

struct SyncCommandOptions {
  std::string take;
  std::string report;
  bool json = false;
};

absl::Status Sync(const SyncCommandOptions& options) {
  WEFT_ASSIGN_OR_RETURN(const SyncAnalysis analysis, AnalyzeSync(options.take));
  if (!options.report.empty()) {
    WEFT_RETURN_IF_ERROR(WriteFileAtomically(options.report, SyncPage(analysis)));
  }
  WEFT_RETURN_IF_ERROR(PrintMessage(analysis.report, options.json, SyncReportText(analysis.report)));
  return VerdictStatus(analysis.report.verdict());
}

}  // namespace

void AddTakeSyncCommand(CLI::App& take, CommandLine& line) {
  const auto [sync, options] = AddCommand<SyncCommandOptions>(
      take, line, Sync, "sync",
      "Show the synchronization of a take's cameras: offsets within the sets, drift and jumps of "
      "their clocks, PTP, and every cause of a missing frame. Begins with a verdict; findings "
      "name what to do. Exit status 1 when the verdict is bad.",
      "  weft take sync take --report sync.html");
  AddRequired(*sync, "TAKE", options->take, "Folder of the take");
  AddOption(*sync, "--report FILE", options->report, "Write a page with plots over the take");
  sync->add_flag("--json", options->json, "Print JSON (weft.v1.SyncReport)");
}

}  // namespace weft
