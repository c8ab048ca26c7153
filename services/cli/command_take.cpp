// weft take: recorded takes.
#include <cstdio>
#include <memory>
#include <optional>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "capture/recorded_take.h"
#include "capture/recover_take.h"
#include "services/cli/commands.h"
#include "services/cli/progress.h"
#include "services/cli/take_text.h"
#include "services/files/json_file.h"
#include "services/recording/disk_speed.h"
#include "services/recording/take_copy.h"
#include "services/recording/take_file.h"

namespace weft {
namespace {

struct TakeCommandOptions {
  std::string take;
  std::string out;
  std::string mosaic;
  std::string sets;
  std::vector<std::string> shifts;
  double fps = 0;
  double size_gib = 1;
  bool compress = false;
  bool demosaic = false;
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

CopyProgress ProgressOf(const std::shared_ptr<Progress>& bar) {
  return [bar](uint64_t done, uint64_t total) { bar->Set(done, total); };
}

std::shared_ptr<Progress> MakeProgress(const char* label, bool quiet) {
  return std::make_shared<Progress>(label, 0, ProgressVisible(quiet));
}

absl::Status Import(const TakeCommandOptions& options, bool quiet) {
  TakeCopyOptions copy;
  copy.fps = options.fps;
  copy.recorder.take.stream.compress = options.compress;
  if (!options.mosaic.empty()) {
    const absl::StatusOr<PixelFormat> mosaic = PixelFormatFromName(options.mosaic);
    if (!mosaic.ok()) return mosaic.status();
    copy.mosaic = *mosaic;
  }
  const absl::StatusOr<uint64_t> sets =
      ImportImages(options.take, options.out, copy, ProgressOf(MakeProgress("import", quiet)));
  if (!sets.ok()) return sets.status();
  std::printf("%s: %llu frame sets\n", options.out.c_str(), static_cast<unsigned long long>(*sets));
  return absl::OkStatus();
}

absl::Status Export(const TakeCommandOptions& options, bool quiet) {
  const absl::StatusOr<uint64_t> sets =
      ExportImages(options.take, options.out, options.demosaic, ProgressOf(MakeProgress("export", quiet)));
  if (!sets.ok()) return sets.status();
  std::printf("%s: images of %llu frame sets\n", options.out.c_str(), static_cast<unsigned long long>(*sets));
  return absl::OkStatus();
}

// "A:B", either of them empty; numbers of sets, B excluded as in --frames.
absl::Status ParseSets(const std::string& text, TrimOptions& trim) {
  if (text.empty()) return absl::OkStatus();
  const std::vector<std::string> parts = absl::StrSplit(text, ':');
  uint64_t end = UINT64_MAX;
  const bool fits = parts.size() == 2 && (parts[0].empty() || absl::SimpleAtoi(parts[0], &trim.first_set)) &&
                    (parts[1].empty() || (absl::SimpleAtoi(parts[1], &end) && end > trim.first_set));
  if (!fits) {
    return absl::InvalidArgumentError(
        absl::StrCat("--sets ", text,
                     ": expected A:B, the numbers of the first set and of the first one after the range"));
  }
  trim.last_set = end - 1;
  return absl::OkStatus();
}

absl::Status ParseShifts(const std::vector<std::string>& shifts, TrimOptions& trim) {
  for (const std::string& text : shifts) {
    const std::vector<std::string> parts = absl::StrSplit(text, absl::MaxSplits('=', 1));
    int64_t shift_ns = 0;
    if (parts.size() != 2 || !absl::SimpleAtoi(parts[1], &shift_ns)) {
      return absl::InvalidArgumentError(absl::StrCat("--shift-ns ", text, ": expected CAMERA=NANOSECONDS"));
    }
    trim.shift_ns[parts[0]] = shift_ns;
  }
  return absl::OkStatus();
}

absl::Status Trim(const TakeCommandOptions& options, bool quiet) {
  TrimOptions trim;
  trim.recorder.take.stream.compress = options.compress;
  if (absl::Status status = ParseSets(options.sets, trim); !status.ok()) return status;
  if (absl::Status status = ParseShifts(options.shifts, trim); !status.ok()) return status;
  const absl::StatusOr<uint64_t> sets =
      TrimTake(options.take, options.out, trim, ProgressOf(MakeProgress("trim", quiet)));
  if (!sets.ok()) return sets.status();
  std::printf("%s: %llu frame sets\n", options.out.c_str(), static_cast<unsigned long long>(*sets));
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

void AddCopyCommands(CLI::App& take, CommandLine& line) {
  const auto options = std::make_shared<TakeCommandOptions>();
  const auto add_out = [&](CLI::App& command, const char* what) {
    command.add_option("--out", options->out, what)->required()->type_name("DIR");
  };
  const auto add_compress = [&](CLI::App& command) {
    command.add_flag("--compress", options->compress,
                     "Planes apart, predictor and zstd: lossless, half the size, a core's work");
  };
  CLI::App* import =
      AddCommand(take, "import",
                 "Make a take of a folder of images, without loss. Images that cannot be read are "
                 "missing in the take, with the reason.",
                 "  weft take import dump --out take --fps 30");
  import
      ->add_option("DUMP", options->take, "Folder with <frame>/<camera>.png or cam<camera>/image<frame>.png")
      ->required()
      ->type_name("");
  add_out(*import, "Folder of the new take");
  add_compress(*import);
  import->add_option("--fps", options->fps, "Frames per second, for the times of the frames; 0: no times")
      ->type_name("N");
  import->add_option("--mosaic", options->mosaic, "Grey images are a Bayer mosaic of this order")
      ->type_name("ORDER");
  import->callback([options, &line] {
    line.run = [options, &line] { return Import(*options, line.quiet);
};
}  // namespace
);

CLI::App* export_command =
    AddCommand(take, "export",
               "Write a take as images, <out>/<frame>/<camera>.png, 8 bits as `weft register` reads them.",
               "  weft take export take --out images --demosaic");
export_command->add_option("TAKE", options->take, "Folder of the take")->required()->type_name("");
add_out(*export_command, "Folder of the images");
export_command->add_flag("--demosaic", options->demosaic, "Colour images instead of Bayer mosaics");
export_command->callback([options, &line] {
  line.run = [options, &line] { return Export(*options, line.quiet); };
});

CLI::App* trim = AddCommand(
    take, "trim", "Copy a range of frame sets into a take of its own; numbers, times and bytes stay.",
    "  weft take trim take --sets 100:200 --out walk\n"
    "  weft take trim take --out shifted --shift-ns cam3=-1500000");
trim->add_option("TAKE", options->take, "Folder of the take")->required()->type_name("");
trim->add_option("--sets", options->sets, "Numbers of the sets, the last one excluded; all by default")
    ->type_name("A:B");
trim->add_option("--shift-ns", options->shifts, "Add this to the device times of a camera")
    ->type_name("CAMERA=NS");
add_out(*trim, "Folder of the new take");
add_compress(*trim);
trim->callback([options, &line] { line.run = [options, &line] { return Trim(*options, line.quiet); }; });
}  // namespace weft

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
  AddTakeSyncCommand(*take, line);
  AddCopyCommands(*take, line);

  CLI::App* disk = AddCommand(*take, "test-disk", "Measure how fast a disk takes frames, before a take does.",
                              "  weft take test-disk /data/takes");
  disk->add_option("DIR", options->take, "A folder on the disk")->required()->type_name("");
  disk->add_option("--size-gib", options->size_gib, "How much to write")
      ->type_name("GIB")
      ->check(CLI::Range(0.01, 1024.0));
  disk->callback([options, &line] { line.run = [options] { return TestDisk(*options); }; });
}

}  // namespace weft
