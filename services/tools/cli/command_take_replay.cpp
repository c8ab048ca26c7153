// weft take replay: a recorded take, played again.
#include <algorithm>
#include <cstdio>
#include <iostream>
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "services/ground/process/exit_status.h"
#include "services/studio/recording/replay_take.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/cli/preview_options.h"
#include "services/tools/cli/progress.h"
#include "services/tools/cli/take_range.h"

namespace weft {
namespace {

struct ReplayCommandOptions {
  std::string take;
  TakeRange range;
  PreviewCommandOptions preview;
  double speed = 1;
  bool fastest = false;
  bool step = false;
  bool list = false;
  bool json = false;
};

std::string SetLine(const RawFrameSet& set, double since_begin_ms, double late_ms) {
  std::string text = absl::StrFormat("set %d  %+10.3f ms  late %.3f ms  %d frames, %d bytes", set.number,
                                     since_begin_ms, late_ms, set.frames.size(), set.bytes());
  for (const MissingFrame& missing : set.missing)
    absl::StrAppend(&text, "; no ", missing.camera_id, ": ", missing.reason);
  return text;
}

std::string SummaryText(const v1::TakeReplay& replay) {
  const double wall_s = std::max(replay.wall_s(), 1e-9);
  const double megabytes = static_cast<double>(replay.bytes()) / 1e6;
  return absl::StrFormat(
      "%s: %d frame sets, %d frames, %d missing, %.1f MB in %.2f s (%.1f sets/s, %.1f MB/s)\n"
      "late: median %.3f ms, worst %.3f ms\nchecksum %s\n",
      replay.take(), replay.sets(), replay.frames(), replay.missing(), megabytes, replay.wall_s(),
      static_cast<double>(replay.sets()) / wall_s, megabytes / wall_s, replay.late_median_ms(),
      replay.late_worst_ms(), replay.checksum());
}

// The next line of standard input; false at its end, or when it is "q".
bool WaitForEnter() {
  std::string input;
  return std::getline(std::cin, input) && input != "q";
}

absl::StatusOr<std::shared_ptr<Replay>> OpenReplay(const ReplayCommandOptions& options) {
  ReplayOptions replay;
  replay.speed = options.speed;
  if (options.fastest) replay.mode = ReplayMode::kFastest;
  if (options.step) replay.mode = ReplayMode::kStepwise;
  WEFT_ASSIGN_OR_RETURN(replay.view, ParseTakeRange(options.range));
  return Replay::Open(options.take, replay);
}

absl::Status RunReplay(const ReplayCommandOptions& options, bool quiet) {
  WEFT_ASSIGN_OR_RETURN(const std::shared_ptr<Replay> opened, OpenReplay(options));
  Replay& replay = *opened;
  for (const std::string& warning : replay.view().take().warnings()) PrintWarning(warning);
  WEFT_ASSIGN_OR_RETURN(const std::unique_ptr<LivePreview> preview,
                        StartPreview(options.preview, options.take));
  const bool lists = options.list || options.step;
  FILE* const list = options.json ? stderr : stdout;
  Progress progress("replay", replay.view().sets().size(), ProgressVisible(quiet) && !lists);
  const int64_t begin_ns = replay.SetTime_ns(0);
  size_t index = 0;
  if (options.step) replay.clock().Step();
  v1::TakeReplay summary = ReplayTake(replay, [&](const RawFrameSet& set, std::chrono::nanoseconds late) {
    progress.Advance();
    if (preview) preview->Offer(set);
    const double since_ms = static_cast<double>(replay.SetTime_ns(index++) - begin_ns) / 1e6;
    if (lists) {
      absl::FPrintF(list, "%s\n", SetLine(set, since_ms, static_cast<double>(late.count()) / 1e6));
      std::fflush(list);
    }
    if (!options.step) return true;
    replay.clock().Step();
    return WaitForEnter();
  });
  summary.set_take(options.take);
  if (preview) WarnOfPreview(preview->Finish());
  return PrintMessage(summary, options.json, SummaryText(summary));
}

}  // namespace

void AddTakeReplayCommand(CLI::App& take, CommandLine& line) {
  const auto [replay, options] = AddCommand<ReplayCommandOptions>(
      take, line, RunReplay, "replay",
      "Play a take again, every frame with the bytes and times that it was recorded with: at the "
      "recorded speed, slower or faster, as fast as the disk is, or set by set. Says how late "
      "frame sets came, and a checksum that is the same for every replay of the same sets.",
      "  weft take replay take\n"
      "  weft take replay take --fastest --frames 100:200\n"
      "  weft take replay take --step          (Enter: the next frame set; q: the end)\n"
      "  weft take replay take --speed 0.5 --shift cam3=-33.3 --list\n"
      "  weft take replay take --preview look --board board.json --template shirt");
  AddRequired(*replay, "TAKE", options->take, "Folder of the take");
  CLI::Option* speed =
      AddOption(*replay, "--speed X", options->speed, "Times the recorded speed", CLI::PositiveNumber);
  CLI::Option* fastest = replay->add_flag("--fastest", options->fastest, "As fast as frames can be read");
  CLI::Option* step = replay->add_flag("--step", options->step, "One frame set per line on standard input");
  fastest->excludes(speed)->excludes(step);
  step->excludes(speed);
  AddTakeRangeOptions(*replay, options->range);
  AddPreviewOptions(*replay, options->preview);
  replay->add_flag("--list", options->list, "A line per frame set");
  replay->add_flag("--json", options->json, "Print JSON (weft.v1.TakeReplay); the list goes to stderr");
}

}  // namespace weft
