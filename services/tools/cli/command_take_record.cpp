// weft take record: live cameras into a take.
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "services/formats/verdict/verdict.h"
#include "services/ground/process/exit_status.h"
#include "services/studio/recording/disk_check.h"
#include "services/studio/recording/live_recording.h"
#include "services/studio/recording/session_file.h"
#include "services/studio/recording/take_file.h"
#include "services/studio/recording/take_words.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/cli/preview_options.h"
#include "services/tools/cli/take_text.h"

namespace weft {
namespace {

struct RecordCommandOptions {
  std::string session;
  std::string out;
  double seconds = 0;
  PreviewCommandOptions preview;
  bool no_disk_test = false;
  bool json = false;
};

std::atomic<bool> interrupted = false;

std::string StateLine(const LiveRecordingState& state) {
  return absl::StrFormat("%5.0f s  %s sets, %s dropped, %s frames missing, %d MiB wait", state.elapsed_s,
                         WithSeparators(state.recorder.sets_recorded),
                         WithSeparators(state.recorder.sets_dropped),
                         WithSeparators(state.recorder.frames_missing), state.recorder.queued_bytes >> 20);
}

absl::Status PrintRecording(const std::string& folder, bool json) {
  WEFT_ASSIGN_OR_RETURN(const v1::TakeInfo info, DescribeTake(folder));
  if (json) {
    WEFT_RETURN_IF_ERROR(PrintJsonMessage(info));
    return VerdictStatus(info.verdict());
  }
  std::fputs(TakeInfoText(info).c_str(), stdout);
  for (const std::string& warning : info.warnings()) PrintWarning(warning);
  std::vector<std::pair<std::string, std::string>> said;
  for (const v1::TakeCamera& c : info.take().cameras())
    said.emplace_back(
        c.id(), absl::StrCat(WithSeparators(c.frames_received()), " frames, ",
                             WithSeparators(c.frames_lost()), " lost, ", WithSeparators(c.packets_resent()),
                             " packets resent, ", WithSeparators(c.packets_missing()), " packets missing, ",
                             c.disconnections(), " times away, ", c.reconnections(), " times back"));
  for (const std::string& of : CameraLines(said, said.size())) std::printf("%s\n", of.c_str());
  return VerdictStatus(info.verdict());
}

// In the folder that the take's own is made in.
absl::Status TestDiskOf(const RecordCommandOptions& options,
                        const std::vector<std::unique_ptr<CameraSource>>& cameras,
                        const LiveRecordingOptions& recording) {
  if (options.no_disk_test) return absl::OkStatus();
  std::filesystem::path folder = std::filesystem::absolute(options.out).parent_path();
  while (!std::filesystem::exists(folder) && folder.has_relative_path()) folder = folder.parent_path();
  WEFT_ASSIGN_OR_RETURN(const auto warnings, TestDisk(folder.string(), cameras, recording, "--no-disk-test"));
  for (const std::string& warning : warnings) PrintWarning(absl::StrCat(folder.string(), ": ", warning));
  return absl::OkStatus();
}

absl::Status Record(const RecordCommandOptions& options, bool quiet) {
  WEFT_ASSIGN_OR_RETURN(const v1::Session session, ReadSession(options.session));
  WEFT_ASSIGN_OR_RETURN(LiveRecordingOptions recording, RecordingOptionsOf(session));
  recording.seconds = options.seconds;
  WEFT_ASSIGN_OR_RETURN(const auto cameras, OpenCameras(session));
  WEFT_RETURN_IF_ERROR(TestDiskOf(options, cameras, recording));
  for (const std::string& warning : ClockWarnings(cameras)) PrintWarning(warning);
  WEFT_ASSIGN_OR_RETURN(const std::unique_ptr<LivePreview> preview,
                        StartPreview(options.preview, options.out));
  if (preview) recording.look = [&](const RawFrameSet& set) { preview->Offer(set); };
  std::signal(SIGINT, [](int) { interrupted = true; });
  std::signal(SIGTERM, [](int) { interrupted = true; });
  const bool shows_progress = !quiet && isatty(STDERR_FILENO);
  int reports = 0;
  const auto show = [&](const LiveRecordingState& state) {
    if (preview) preview->Describe(StateLine(state));
    if (reports++ % 10 == 0 && shows_progress) std::fprintf(stderr, "\r%s", StateLine(state).c_str());
  };
  const absl::StatusOr<v1::Take> take = RecordLive(options.out, cameras, recording, interrupted, show);
  if (reports > 0 && shows_progress) std::fputc('\n', stderr);
  if (preview) WarnOfPreview(preview->Stop());
  if (!take.ok()) {
    if (reports > 0)
      static_cast<void>(PrintRecording(options.out, options.json));  // what is on the disk all the same
    return take.status();
  }
  const absl::Status outcome = PrintRecording(options.out, options.json);
  if (!outcome.ok() || take->stop_cause().empty()) return outcome;
  return absl::ResourceExhaustedError(absl::StrCat(options.out, ": ", take->stop_cause()));
}

}  // namespace

void AddTakeRecordCommand(CLI::App& take, CommandLine& line) {
  const auto [record, options] = AddCommand<RecordCommandOptions>(
      take, line, Record, "record",
      "Record the cameras of a session into a new take, until the time is over or "
      "Ctrl-C; then give a verdict, what was recorded, why frames are missing, and "
      "what to do next. Exit status 1 when the verdict is bad. Measures before "
      "whether the disk keeps up with the cameras, and refuses where it does not.",
      "  weft take record --session session.json --out take --seconds 60\n"
      "  weft take record --session session.json --out take --preview look --board "
      "board.json --template shirt");
  AddRequired(*record, "--session FILE", options->session, "session.json with cameras, rate and tolerance");
  AddRequired(*record, "--out DIR", options->out, "Folder of the new take");
  AddOption(*record, "--seconds S", options->seconds, "How long; 0: until Ctrl-C", CLI::NonNegativeNumber);
  AddPreviewOptions(*record, options->preview);
  record->add_flag("--no-disk-test", options->no_disk_test,
                   "Do not measure first whether the disk keeps up with the cameras");
  record->add_flag("--json", options->json, "Print JSON (weft.v1.TakeInfo)");
}

}  // namespace weft
