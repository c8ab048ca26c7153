#include "services/tools/cli/take_text.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "services/formats/files/enum_words.h"
#include "services/formats/verdict/verdict.h"
#include "services/studio/recording/take_words.h"

namespace weft {
namespace {

std::string StateText(const v1::Take& take) {
  const bool is_closed = take.state() == v1::TAKE_STATE_COMPLETE;
  const std::string state = is_closed ? "closed" : EnumWord(take.state(), "unspecified");
  return take.stop_cause().empty() ? state : absl::StrCat(state, ": ", take.stop_cause());
}

// What people call it and say of it, and its timecode.
std::string DescriptionText(const v1::Take& take) {
  std::string text;
  const std::pair<const char*, const std::string*> lines[] = {
      {"slate", &take.slate()}, {"name", &take.name()}, {"notes", &take.notes()}};
  for (const auto& [what, value] : lines)
    if (!value->empty()) absl::StrAppend(&text, what, ": ", *value, "\n");
  if (!take.timecode().empty())
    absl::StrAppendFormat(&text, "timecode: %s at %.6g frames a second\n", take.timecode(),
                          take.timecode_fps());
  return text;
}

}  // namespace

std::string VideoSyncText(const v1::Take& take) {
  std::string text;
  size_t width = 6, file_width = 5;
  for (const v1::TakeCamera& camera : take.cameras()) {
    width = std::max(width, camera.id().size());
    file_width = std::max(file_width, camera.source().size());
  }
  for (const v1::TakeCamera& camera : take.cameras()) {
    if (!camera.has_sync()) continue;
    const v1::CameraSync& sync = camera.sync();
    if (text.empty())
      text = absl::StrFormat("%-*s  %-*s  %7s  %9s  %10s  %8s  %-10s  %s\n", width, "camera", file_width,
                             "video", "frames", "every ms", "offset ms", "sigma ms", "by", "timecode");
    text +=
        absl::StrFormat("%-*s  %-*s  %7d  %9.3f  %10.3f  %8.3f  %-10s  %s\n", width, camera.id(), file_width,
                        camera.source(), sync.frames(), sync.period_ms(), 1e3 * sync.offset_s(),
                        1e3 * sync.offset_sigma_s(), sync.found_by(), sync.timecode());
  }
  return text;
}

std::string TakeInfoText(const v1::TakeInfo& info) {
  std::string text = VerdictText(info.verdict());
  absl::StrAppendFormat(&text, "%s: take %s, %s; %s of %s sets have all cameras\n", info.path(),
                        info.take().id(), StateText(info.take()), WithSeparators(info.sets_complete()),
                        WithSeparators(info.sets() + info.sets_dropped()));
  absl::StrAppendFormat(&text, "%s frame sets of %d cameras, %.1f s, %.2f GB\n", WithSeparators(info.sets()),
                        info.timing_size(), info.duration_s(), static_cast<double>(info.bytes()) / 1e9);
  if (!info.take().origin().empty()) absl::StrAppend(&text, "from ", info.take().origin(), "\n");
  text += DescriptionText(info.take());
  int width = 6;
  for (const v1::TakeTiming& timing : info.timing())
    width = std::max(width, static_cast<int>(timing.camera().size()));
  text += absl::StrFormat("%-*s  %7s  %7s  %11s  %10s  %9s  %9s\n", width, "camera", "frames", "missing",
                          "interval ms", "jitter ms", "offset ms", "worst ms");
  for (const v1::TakeTiming& timing : info.timing()) {
    text += absl::StrFormat("%-*s  %7d  %7d  %11.3f  %10.4f  %9.4f  %9.4f\n", width, timing.camera(),
                            timing.frames(), timing.missing(), timing.interval_mean_ms(),
                            timing.interval_jitter_ms(), timing.offset_mean_ms(), timing.offset_worst_ms());
  }
  text += VideoSyncText(info.take());
  for (const std::string& line : CauseLines(info.causes())) absl::StrAppend(&text, line, "\n");
  for (const std::string& note : info.notes()) absl::StrAppend(&text, "note: ", note, "\n");
  return text;
}

std::string TakeCheckText(const v1::TakeCheckReport& report) {
  std::string text =
      VerdictText(report.verdict()) +
      absl::StrFormat(
          "%s: %s; %d frame sets, %d of them with all cameras; %d frames intact, %d missing with a reason, "
          "%d sets dropped with a cause, %.2f GB read\n",
          report.take(), report.whole() ? "whole" : "not whole", report.sets(), report.complete_sets(),
          report.frames(), report.missing(), report.dropped(), static_cast<double>(report.bytes()) / 1e9);
  for (const std::string& problem : report.problems()) absl::StrAppend(&text, "problem: ", problem, "\n");
  for (const std::string& warning : report.warnings()) absl::StrAppend(&text, "warning: ", warning, "\n");
  return text;
}

std::string TakeRecoveryText(const v1::TakeRecoveryReport& report) {
  std::string text =
      VerdictText(report.verdict()) + absl::StrFormat(
                                          "%s: %d frame sets, %d of them brought back; %d frames lost, %d "
                                          "frames of unfinished sets not there\n",
                                          report.take(), report.sets(), report.brought_back(),
                                          report.frames_lost(), report.frames_unfinished());
  for (const std::string& damage : report.damage()) absl::StrAppend(&text, "lost: ", damage, "\n");
  for (const std::string& change : report.changes())
    absl::StrAppend(&text, report.dry_run() ? "would do: " : "done: ", change, "\n");
  if (!report.kept_aside().empty())
    absl::StrAppend(&text, "kept aside: ", report.kept_aside(), "; `weft take recover --purge ",
                    report.take(), "` removes it\n");
  return text;
}

}  // namespace weft
