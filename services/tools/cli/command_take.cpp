// weft take: recorded takes.
#include <cstdio>
#include <memory>

#include "services/formats/verdict/verdict.h"
#include "services/ground/process/exit_status.h"
#include "services/studio/recording/disk_speed.h"
#include "services/studio/recording/take_file.h"
#include "services/studio/recording/take_recovery.h"
#include "services/studio/recording/take_words.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/cli/remote_operation.h"
#include "services/tools/cli/take_text.h"

namespace weft {
namespace {

struct TakeCommandOptions {
  std::string take;
  double size_gib = 1;
  bool json = false;
  bool force = false;
  bool dry_run = false;
  bool purge = false;
};

absl::Status Info(const TakeCommandOptions& options) {
  WEFT_ASSIGN_OR_RETURN(const v1::TakeInfo info, DescribeTake(options.take));
  if (options.json) return PrintJsonMessage(info);
  std::fputs(TakeInfoText(info).c_str(), stdout);
  for (const std::string& warning : info.warnings()) PrintWarning(warning);
  return absl::OkStatus();
}

absl::Status Verify(const TakeCommandOptions& options) {
  WEFT_ASSIGN_OR_RETURN(const v1::TakeCheckReport report, VerifyRecordedTake(options.take));
  WEFT_RETURN_IF_ERROR(PrintMessage(report, options.json, TakeCheckText(report)));
  return VerdictStatus(report.verdict());
}

absl::Status Purge(const TakeCommandOptions& options) {
  WEFT_ASSIGN_OR_RETURN(const uint64_t bytes, PurgeRecovered(options.take));
  std::printf("%s: %.2f GB of earlier recoveries removed\n", options.take.c_str(),
              static_cast<double>(bytes) / 1e9);
  return absl::OkStatus();
}

absl::Status Recover(const TakeCommandOptions& options) {
  if (options.purge) return Purge(options);
  WEFT_ASSIGN_OR_RETURN(const v1::TakeRecoveryReport report,
                        RecoverRecordedTake(options.take, {options.force, options.dry_run}));
  WEFT_RETURN_IF_ERROR(PrintMessage(report, options.json, TakeRecoveryText(report)));
  return VerdictStatus(report.verdict());
}

absl::Status RunDiskTest(const TakeCommandOptions& options) {
  WEFT_ASSIGN_OR_RETURN(const DiskSpeed speed,
                        MeasureDiskSpeed(options.take, static_cast<uint64_t>(options.size_gib * (1 << 30))));
  std::printf("%s: %.2f GB/s%s, slowest write of 8 MiB %.0f ms, %s\n", options.take.c_str(),
              speed.bytes_per_s / 1e9, speed.bypasses_page_cache ? "" : " (through the page cache)",
              speed.slowest_write_ms,
              RoomText(static_cast<double>(speed.free_bytes), 0, speed.bytes_per_s).c_str());
  return absl::OkStatus();
}

}  // namespace

void AddTakeCommand(CLI::App& app, CommandLine& line) {
  CLI::App* take = AddGroup(app, "take", "Record takes; show, check, repair and copy them");
  const auto options = std::make_shared<TakeCommandOptions>();
  const auto add = [&](const char* name, const char* description, const char* example) {
    CLI::App* command = AddCommand(*take, name, description, example);
    AddRequired(*command, "TAKE", options->take, "Folder of the take");
    command->add_flag("--json", options->json, "Print JSON");
    return command;
  };
  CLI::App* info = add("info",
                       "Show what a take holds: the verdict, cameras, frame sets, sync between the cameras, "
                       "and why frames are missing. Exit status 0, whatever the verdict.",
                       "  weft take info take\n"
                       "  weft take info take:20260131-104500-1a2b3c4d --server 127.0.0.1:7411");
  RunHereOrAtDaemon(*info, line, [options] { return Info(*options); });
  CLI::App* verify = add(
      "verify",
      "Read every byte of a take and check it: checksums, streams, indexes, ledger, take.json. Exit status 1 "
      "when anything is not as it should be; padding that is not zero is a warning, for it harms no frame.",
      "  weft take verify take\n"
      "  weft take verify take:20260131-104500-1a2b3c4d --server 127.0.0.1:7411");
  RunHereOrAtDaemon(*verify, line, [options] { return Verify(*options); });
  CLI::App* recover = add("recover",
                          "Make a take readable again whose recorder crashed or whose files are damaged. "
                          "Every intact frame is kept; a gap with its reason replaces each lost frame; "
                          "index, ledger and totals are rebuilt. Replaced data are kept in TAKE/recovered.",
                          "  weft take recover take\n"
                          "  weft take recover --dry-run take\n"
                          "  weft take recover --force take");
  RunWith(*recover, line, options, Recover);
  recover->add_flag("--force", options->force, "Also a take that was closed");
  recover->add_flag("--dry-run", options->dry_run, "Say what would be done, change nothing");
  recover->add_flag("--purge", options->purge, "Only remove what earlier recoveries kept in TAKE/recovered");
  AddTakeRecordCommand(*take, line);
  AddRemoteTakeCommands(*take, line);
  AddTakeReplayCommand(*take, line);
  AddTakeSyncCommand(*take, line);
  AddTakeImportCommand(*take, line);
  AddTakeDescribeCommands(*take, line);
  AddTakeCopyCommands(*take, line);

  CLI::App* disk = AddCommand(*take, "test-disk", "Measure how fast a disk takes frames, before a take does.",
                              "  weft take test-disk /data/takes");
  AddRequired(*disk, "DIR", options->take, "A folder on the disk");
  AddOption(*disk, "--size-gib GIB", options->size_gib, "How much to write", CLI::Range(0.01, 1024.0));
  RunWith(*disk, line, options, RunDiskTest);
}

}  // namespace weft
