// weft take record: live cameras into a take.
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "services/cli/commands.h"
#include "services/cli/take_text.h"
#include "services/recording/live_recording.h"
#include "services/recording/session_file.h"
#include "services/recording/take_file.h"

namespace weft {
namespace {

struct RecordCommandOptions {
  std::string session;
  std::string out;
  double seconds = 0;
  bool json = false;
};

std::atomic<bool> interrupted = false;

std::string StateLine(const LiveRecordingState& state) {
  return absl::StrFormat("%5.0f s  %d sets, %d dropped, %d frames missing, %d MiB wait", state.elapsed_s,
                         state.recorder.sets_recorded, state.recorder.sets_dropped,
                         state.recorder.frames_missing, state.recorder.queued_bytes >> 20);
}

absl::Status PrintOutcome(const std::string& folder, bool json) {
  const absl::StatusOr<v1::TakeInfo> info = DescribeTake(folder);
  if (!info.ok()) return info.status();
  if (json) return PrintJsonMessage(*info);
  std::fputs(TakeInfoText(*info).c_str(), stdout);
  for (const std::string& warning : info->warnings()) PrintWarning(warning);
  for (const v1::TakeCamera& c : info->take().cameras()) {
    absl::PrintF("camera %s: %d frames, %d lost, %d packets resent, %d packets missing, %d times away\n",
                 c.id(), c.frames_received(), c.frames_lost(), c.packets_resent(), c.packets_missing(),
                 c.disconnections());
  }
  return absl::OkStatus();
}

absl::Status Record(const RecordCommandOptions& options, bool quiet) {
  const absl::StatusOr<v1::Session> session = ReadSession(options.session);
  if (!session.ok()) return session.status();
  absl::StatusOr<LiveRecordingOptions> recording = RecordingOptionsOf(*session);
  if (!recording.ok()) return recording.status();
  recording->seconds = options.seconds;
  const auto cameras = OpenCameras(*session);
  if (!cameras.ok()) return cameras.status();
  std::signal(SIGINT, [](int) { interrupted = true; });
  std::signal(SIGTERM, [](int) { interrupted = true; });
  const bool shows_progress = !quiet && isatty(STDERR_FILENO);
  int reports = 0;
  const auto show = [&](const LiveRecordingState& state) {
    if (shows_progress && reports++ % 10 == 0) std::fprintf(stderr, "\r%s", StateLine(state).c_str());
  };
  const absl::StatusOr<v1::Take> take = RecordLive(options.out, *cameras, *recording, interrupted, show);
  if (reports > 0) std::fputc('\n', stderr);
  if (!take.ok()) return take.status();
  if (absl::Status status = PrintOutcome(options.out, options.json); !status.ok()) return status;
  if (take->stop_cause().empty()) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat(options.out, ": ", take->stop_cause()));
}

}  // namespace

void AddTakeRecordCommand(CLI::App& take, CommandLine& line) {
  const auto options = std::make_shared<RecordCommandOptions>();
  CLI::App* record =
      AddCommand(take, "record",
                 "Record the cameras of a session into a new take, until the time is over or Ctrl-C; "
                 "then say what was recorded, and why frames are missing.",
                 "  weft take record --session session.json --out take --seconds 60");
  record->add_option("--session", options->session, "session.json with cameras, rate and tolerance")
      ->required()
      ->type_name("FILE");
  record->add_option("--out", options->out, "Folder of the new take")->required()->type_name("DIR");
  record->add_option("--seconds", options->seconds, "How long; 0: until Ctrl-C")
      ->type_name("S")
      ->check(CLI::NonNegativeNumber);
  record->add_flag("--json", options->json, "Print JSON (weft.v1.TakeInfo)");
  record->callback(
      [options, &line] { line.run = [options, &line] { return Record(*options, line.quiet); }; });
}

}  // namespace weft
