// weft avatar drive: a garment that was captured before, followed by a few cameras.
#include <unistd.h>

#include <cstdio>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "services/formats/options/presets.h"
#include "services/ground/process/exit_status.h"
#include "services/ground/process/stop_on_signal.h"
#include "services/results/report/driven_sigma.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/input_options.h"
#include "services/tools/cli/job_view.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/cli/pipeline_flags.h"
#include "services/tools/cli/print_verdict.h"
#include "services/tools/cli/progress.h"
#include "services/tools/cli/run_job.h"
#include "services/tools/cli/upload_inputs.h"
#include "services/work/animation/drive_inputs.h"
#include "services/work/animation/drive_live.h"
#include "services/work/kinds/local_job.h"

namespace weft {
namespace {

struct DriveOptions {
  v1::RegistrationSpec spec;  // its paths, its frames, and the avatar
  std::string mosaic;
  std::vector<std::string> cameras;
  double fps = 0;
  PipelineFlags pipeline;
  bool observations = false;
  int threads = 0;
  JobAtDaemon daemon;
  bool live = false;
  double speed = 1;
  std::string session;
  bool json = false;
};

absl::StatusOr<v1::RegistrationSpec> DriveSpecOf(const DriveOptions& options) {
  const std::vector<std::string> stages = {"decode"};
  WEFT_ASSIGN_OR_RETURN(const v1::PipelineOptions changes, ChangesOf(options.pipeline, stages));
  v1::RegistrationSpec spec = options.spec;
  if (options.live && !options.daemon.server.empty()) spec.set_live_every(1);
  v1::DrivingSpec& driving = *spec.mutable_driving();
  driving.mutable_cameras()->Add(options.cameras.begin(), options.cameras.end());
  driving.set_fps(options.fps);
  v1::RegistrationOptions asked;
  asked.set_mosaic(options.mosaic);
  asked.set_write_observations(options.observations);
  *asked.mutable_pipeline() = OfStages(changes, stages);
  WEFT_ASSIGN_OR_RETURN(*spec.mutable_options(), EffectiveDriveOptions(asked));
  return WithAbsolutePaths(std::move(spec));
}

ConfinedFiles DriveFilesOf(const DriveOptions& options) {
  const v1::RegistrationSpec& spec = options.spec;
  return {.readable = {spec.dump(), spec.rig(), spec.board(), spec.garment(), spec.driving().avatar()},
          .writable = {spec.out()}};
}

// What a live run tells while it goes: a line on a terminal, and one for each frame that failed.
class LiveView {
 public:
  explicit LiveView(bool quiet) : quiet_(quiet), draws_(!quiet && isatty(STDERR_FILENO)) {}
  ~LiveView() { Wipe(); }
  void Show(const v1::LiveDriving& now, const v1::FrameInfo& info) {
    if (info.state() == v1::FRAME_STATE_FAILED && !quiet_) {
      Wipe();
      std::fprintf(stderr, "%s\n", FrameLine(info, false).c_str());
    }
    if (!draws_) return;
    std::fprintf(stderr, "\r%s  %4.0f ms, %s \033[K", info.frame().c_str(), 1000 * info.latency_s(),
                 LiveDrivingText(now).c_str());
    drawn_ = true;
  }

 private:
  void Wipe() {
    if (drawn_) std::fputs("\r\033[K", stderr);
    drawn_ = false;
  }
  const bool quiet_, draws_;
  bool drawn_ = false;
};

absl::StatusOr<v1::Job> RunLive(const DriveOptions& options, const v1::RegistrationSpec& spec, bool quiet,
                                const std::stop_token& stop) {
  LiveView view(quiet);
  const LiveDriveRequest request = {
      .spec = spec, .speed = options.speed, .session_file = options.session, .threads = options.threads};
  return DriveLive(
      request, [&](const v1::LiveDriving& now, const v1::FrameInfo& info) { view.Show(now, info); }, stop);
}

absl::StatusOr<v1::Job> RunAll(const DriveOptions& options, const v1::RegistrationSpec& spec, bool quiet,
                               const std::stop_token& stop) {
  Progress progress("drive", 1, ProgressVisible(quiet));
  return RunLocalJob(
      {.spec = spec,
       .recorded = spec,
       .command = "weft avatar drive",
       .limits = {.threads = options.threads}},
      [&](const v1::JobUpdate& update) {
        const v1::FrameCounts& frames = update.job().frames();
        progress.Set(static_cast<uint64_t>(frames.done() + frames.degraded() + frames.failed()),
                     static_cast<uint64_t>(frames.total()));
        for (const v1::FrameInfo& info : update.frames())
          if (info.state() == v1::FRAME_STATE_FAILED && !quiet) progress.PrintLine(FrameLine(info, false));
      },
      stop);
}

absl::Status Drive(const DriveOptions& options, bool quiet) {
  if (!options.daemon.server.empty() && options.live && options.daemon.upload)
    return absl::InvalidArgumentError("--live: a take that grows cannot be sent with --upload");
  absl::StatusOr<v1::RegistrationSpec> spec = DriveSpecOf(options);
  if (spec.ok() && options.daemon.upload) spec = UploadInputs(options.daemon.server, *std::move(spec), quiet);
  if (!spec.ok()) return spec.status();
  const StopOnSignal signals;  // before, Ctrl-C ends the upload, which the same command goes on with
  const JobRun at_daemon{*spec, "avatar drive", options.daemon.server, options.daemon.priority, {}};
  if (options.daemon.detach) return DetachJob(at_daemon);
  const bool is_here = options.daemon.server.empty();
  WEFT_ASSIGN_OR_RETURN(const v1::Job job, !is_here       ? RunJob(at_daemon, quiet, signals.token())
                                           : options.live ? RunLive(options, *spec, quiet, signals.token())
                                                          : RunAll(options, *spec, quiet, signals.token()));
  if (!quiet && is_here)
    for (const std::string& warning : job.warnings()) PrintWarning(warning);
  if (options.json) {
    WEFT_RETURN_IF_ERROR(PrintJsonMessage(job));
  } else {
    if (job.has_verdict()) PrintVerdict(job.verdict());
    if (const std::string note = DrivenSigmaNote(job); !note.empty())
      std::printf("note     %s\n", note.c_str());
    if (job.driven().has_live()) std::printf("live     %s\n", LiveDrivingText(job.driven().live()).c_str());
    std::printf("results  %s\nreport   %s/report.html\n", options.spec.out().c_str(),
                options.spec.out().c_str());
  }
  return OutcomeOf(job);
}

// The order of these functions is that of the help.
void AddDriveInputs(CLI::App& command, DriveOptions& options) {
  v1::RegistrationSpec& spec = options.spec;
  AddRequired(command, "dump DUMP", *spec.mutable_dump(), "Folder of images, or a recorded take");
  AddRequired(command, "--avatar DIR", *spec.mutable_driving()->mutable_avatar(),
              "The garment's avatar, of `weft avatar train`");
  AddRequired(command, "--rig FILE", *spec.mutable_rig(), "The cameras, rig.json");
  AddRequired(command, "--board FILE", *spec.mutable_board(), "The printed board, board.json or board.png");
  AddRequired(command, "--template DIR", *spec.mutable_garment(),
              "Folder of the template that the avatar was trained with");
  AddRequired(command, "--out DIR", *spec.mutable_out(), "Folder for the results, made where it is missing");
  AddOption(command, "--cameras NAME,NAME", options.cameras, "Use these cameras of the rig alone, by name")
      ->delimiter(',')
      ->allow_extra_args(false);
  AddFramesOption(command, *spec.mutable_frames(), "Which frames of the dump, all by default");
  AddMosaicOption(command, options.mosaic);
  AddPipelineFlags(command, options.pipeline);
  command.add_flag("--observations", options.observations, "Write <frame>/observations.csv as well");
  AddOption(command, "--fps N", options.fps,
            "Frames per second of a dump that tells no times; 0 for those of the avatar",
            CLI::NonNegativeNumber);
}

void AddDriveLive(CLI::App& command, DriveOptions& options) {
  CLI::Option* server = command.get_option("--server");
  CLI::Option* live = command.add_flag(
      "--live", options.live,
      "Drive frames as they arrive, always the newest one; those that it overtakes are passed over. A DUMP "
      "that is being recorded is followed to its end, another one is replayed in its rhythm. Says how far "
      "meshes are behind the cameras. Ctrl-C ends it, and the same command goes on. Without --live, every "
      "frame is driven anew. With --server, the daemon drives every frame of a take that is being recorded, "
      "and catches up when it has ended");
  CLI::Option* speed = AddOption(command, "--speed X", options.speed,
                                 "With --live, of a recording that is over: times as fast as it was taken",
                                 CLI::PositiveNumber)
                           ->needs(live);
  speed->excludes(server);
  AddOption(
      command, "--session FILE", options.session,
      "With --live: film with the cameras of this session.json, and record them into DUMP, a new take. "
      "Meshes come sooner than from a take that another program records, since they do not wait for the disk")
      ->needs(live)
      ->excludes(speed)
      ->excludes(server);
}

}  // namespace

void AddAvatarDriveCommand(CLI::App& avatar, CommandLine& line) {
  CLI::App* command = AddCommand(
      avatar, "drive",
      "Follow a garment that was captured before with two or three cameras: its avatar supplies what they do "
      "not see. Any number of calibrated cameras at any place will do; three at equal angles are much better "
      "than two. Results are those of a registration, so `weft evaluate` and `weft export` work on them; "
      "sigma_mm tells how far each vertex is to be trusted. Frames are driven in order, since each starts "
      "from the one before. A stopped run is resumed by the same command: complete frames stay. A frame that "
      "shows too little of the garment fails, and the garment is looked for anew in the next one.",
      "  weft avatar drive DUMP --avatar shirt.avatar --rig rig.json --board board.json --template shirt "
      "--out result\n"
      "  weft avatar drive DUMP --avatar shirt.avatar --rig rig.json --board board.json --template shirt "
      "--out result --cameras front,back,left\n"
      "  weft avatar drive DUMP --avatar shirt.avatar --rig rig.json --board board.json --template shirt "
      "--out result --server studio:7411 --upload\n"
      "  weft avatar drive TAKE --live --session session.json --avatar shirt.avatar --rig rig.json --board "
      "board.json --template shirt --out result");
  auto options = std::make_shared<DriveOptions>();
  AddDriveInputs(*command, *options);
  AddJobAtDaemon(
      *command, options->daemon,
      "send DUMP, rig, board, template and avatar to the daemon's library first; as `weft register "
      "--upload`");
  AddDriveLive(*command, *options);
  AddOption(*command, "--threads N", options->threads, "Threads; 0 takes all cores", CLI::Range(0, 1024));
  command->add_flag("--json", options->json, "Print the job as JSON on standard output");
  command->callback([options, &line] {
    line.writes_remotely = !options->daemon.server.empty();
    // Cameras need devices and the network, and a daemon confines its own workers.
    if (options->daemon.server.empty() && options->session.empty()) line.confined = DriveFilesOf(*options);
    line.run = [options, &line] { return Drive(*options, line.quiet); };
  });
}

}  // namespace weft
