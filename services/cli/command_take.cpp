// weft take: recorded takes.
#include <cstdio>
#include <memory>

#include "absl/strings/str_cat.h"
#include "capture/recover_take.h"
#include "services/cli/commands.h"
#include "services/cli/json_output.h"
#include "services/cli/take_text.h"
#include "services/recording/disk_speed.h"
#include "services/recording/take_file.h"

namespace weft {
namespace {

struct TakeCommandOptions {
  std::string take;
  double size_gib = 1;
  bool json = false;
};

absl::Status Info(const TakeCommandOptions& options) {
  const absl::StatusOr<v1::TakeInfo> info = DescribeTake(options.take);
  if (!info.ok()) return info.status();
  if (options.json) return PrintJsonMessage(*info);
  std::fputs(TakeInfoText(*info).c_str(), stdout);
  for (const std::string& warning : info->warnings()) PrintWarning(warning);
  return absl::OkStatus();
}

absl::Status Verify(const TakeCommandOptions& options) {
  const absl::StatusOr<TakeCheck> check = VerifyTake(options.take);
  if (!check.ok()) return check.status();
  v1::TakeCheckReport report;
  report.set_take(options.take);
  report.set_whole(check->problems.empty());
  report.set_sets(check->sets);
  report.set_frames(check->frames);
  report.set_missing(check->missing);
  report.set_dropped(check->dropped);
  report.set_unindexed(check->unindexed);
  report.set_bytes(check->bytes);
  for (const std::string& problem : check->problems) report.add_problems(problem);
  if (options.json) {
    if (absl::Status status = PrintJsonMessage(report); !status.ok()) return status;
  } else {
    std::fputs(TakeCheckText(report).c_str(), stdout);
  }
  if (report.whole()) return absl::OkStatus();
  return absl::DataLossError(absl::StrCat(options.take, ": not whole, ", report.problems_size(),
                                          " problem(s); the first: ", report.problems(0)));
}

absl::Status Recover(const TakeCommandOptions& options) {
  const absl::StatusOr<TakeRecovery> recovery = RecoverTake(options.take);
  if (!recovery.ok()) return recovery.status();
  absl::StatusOr<v1::Take> take = ReadTakeFile(options.take);
  if (!take.ok()) return take.status();
  if (take->state() == v1::TAKE_STATE_RECORDING) {
    take->set_state(v1::TAKE_STATE_RECOVERED);
    take->set_stop_cause("the recorder ended without closing the take");
    take->set_sets_recorded(recovery->sets);
    if (absl::Status status = WriteTakeFile(options.take, *take); !status.ok()) return status;
  }
  v1::TakeRecoveryReport report;
  report.set_take(options.take);
  report.set_sets(recovery->sets);
  report.set_brought_back(recovery->brought_back);
  report.set_cut_off(recovery->cut_off);
  report.set_entries_added(recovery->entries_added);
  for (const std::string& damage : recovery->damage) report.add_damage(damage);
  if (options.json) return PrintJsonMessage(report);
  std::fputs(TakeRecoveryText(report).c_str(), stdout);
  return absl::OkStatus();
}

absl::Status TestDisk(const TakeCommandOptions& options) {
  const absl::StatusOr<DiskSpeed> speed =
      MeasureDiskSpeed(options.take, static_cast<uint64_t>(options.size_gib * (1 << 30)));
  if (!speed.ok()) return speed.status();
  std::printf("%s: %.2f GB/s%s, slowest write of 8 MiB %.0f ms, %.1f GB free: %.0f s of recording\n",
              options.take.c_str(), speed->bytes_per_s / 1e9,
              speed->bypasses_page_cache ? "" : " (through the page cache)", speed->slowest_write_ms,
              static_cast<double>(speed->free_bytes) / 1e9,
              static_cast<double>(speed->free_bytes) / speed->bytes_per_s);
  return absl::OkStatus();
}

}  // namespace

void AddTakeCommand(CLI::App& app, CommandLine& line) {
  CLI::App* take = AddCommand(app, "take", "Record takes; look at, check, repair and copy them", "");
  take->require_subcommand(1);
  const auto options = std::make_shared<TakeCommandOptions>();
  const auto add = [&](const char* name, const char* description, const char* example, auto run) {
    CLI::App* command = AddCommand(*take, name, description, example);
    command->add_option("TAKE", options->take, "Folder of the take")->required()->type_name("");
    command->add_flag("--json", options->json, "Print JSON");
    command->callback([options, &line, run] { line.run = [options, run] { return run(*options); }; });
  };
  add("info",
      "Show what a take holds: cameras, frame sets, sync between the cameras, and why frames are missing.",
      "  weft take info take", Info);
  add("verify",
      "Read every byte of a take and check it: checksums, index, ledger, lengths of the streams. Exit status "
      "1 when "
      "anything is not as it should be.",
      "  weft take verify take", Verify);
  add("recover",
      "Make a take readable again whose recorder crashed: keep every frame set that reached the disk whole, "
      "rebuild "
      "the indexes, complete the ledger.",
      "  weft take recover take", Recover);
  AddTakeRecordCommand(*take, line);
  AddTakeReplayCommand(*take, line);
  AddTakeSyncCommand(*take, line);
  AddTakeCopyCommands(*take, line);

  CLI::App* disk = AddCommand(*take, "test-disk", "Measure how fast a disk takes frames, before a take does.",
                              "  weft take test-disk /data/takes");
  disk->add_option("DIR", options->take, "A folder on the disk")->required()->type_name("");
  disk->add_option("--size-gib", options->size_gib, "How much to write")
      ->type_name("GIB")
      ->check(CLI::Range(0.01, 1024.0));
  disk->callback([options, &line] { line.run = [options] { return TestDisk(*options); }; });
}

}  // namespace weft
