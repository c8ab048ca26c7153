// weft take export, trim: takes into other recordings, and parts of takes.
#include <memory>
#include <string>

#include "absl/strings/str_format.h"
#include "services/studio/recording/proxy_video.h"
#include "services/studio/recording/take_archive.h"
#include "services/studio/recording/take_copy.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/cli/kind_options.h"
#include "services/tools/cli/progress.h"
#include "services/tools/cli/remote_operation.h"
#include "services/tools/cli/take_range.h"
#include "weft/v1/replay.pb.h"

namespace weft {
namespace {

struct CopyCommandOptions {
  std::string source;
  std::string out;
  TakeRange range;
  std::string format = "images";
  int camera_width_px = 0;
  bool compress = false;
  bool demosaic = false;
  bool json = false;
};

CopyProgress MakeProgress(const char* label, bool quiet) {
  const auto bar = std::make_shared<Progress>(label, 0, ProgressVisible(quiet));
  return [bar](uint64_t done, uint64_t total) { bar->Set(done, total); };
}

// `copy`: what is known besides the two places. `text`: the same for people.
absl::Status Say(const CopyCommandOptions& options, v1::TakeCopy copy, const std::string& text) {
  if (!options.json) {
    absl::PrintF("%s: %s\n", options.out, text);
    return absl::OkStatus();
  }
  copy.set_source(options.source);
  copy.set_out(options.out);
  return PrintJsonMessage(copy);
}

// `what`: "images of ", for instance.
absl::Status SayHowMany(const CopyCommandOptions& options, const char* what,
                        const absl::StatusOr<uint64_t>& sets) {
  if (!sets.ok()) return sets.status();
  v1::TakeCopy copy;
  copy.set_sets(*sets);
  return Say(options, copy, absl::StrFormat("%s%d frame sets", what, *sets));
}

absl::Status Archive(const CopyCommandOptions& options, const CopyProgress& progress) {
  WEFT_ASSIGN_OR_RETURN(const uint64_t frames, ExportArchive(options.source, options.out, progress));
  v1::TakeCopy copy;
  copy.set_frames(frames);
  return Say(options, copy,
             absl::StrFormat("%d frames, each decoded again and equal to the take's in every byte", frames));
}

absl::Status ExportTake(const CopyCommandOptions& options, bool quiet) {
  const CopyProgress progress = MakeProgress("export", quiet);
  if (options.format == "ffv1") return Archive(options, progress);
  if (options.format == "proxy") {
    ProxyOptions proxy;
    proxy.camera_width_px = options.camera_width_px;
    return SayHowMany(options, "a video of ", ExportProxy(options.source, options.out, proxy, progress));
  }
  return SayHowMany(options, "images of ",
                    ExportImages(options.source, options.out, options.demosaic, progress));
}

absl::Status Trim(const CopyCommandOptions& options, bool quiet) {
  TrimOptions trim;
  trim.recorder.take.stream.compress = options.compress;
  WEFT_ASSIGN_OR_RETURN(trim.view, ParseTakeRange(options.range));
  return SayHowMany(options, "", TrimTake(options.source, options.out, trim, MakeProgress("trim", quiet)));
}

}  // namespace

void AddTakeCopyCommands(CLI::App& take, CommandLine& line) {
  const auto options = std::make_shared<CopyCommandOptions>();
  const auto add = [&](CLI::App& command, const char* source, const char* about, const char* out) {
    AddRequired(command, source, options->source, about);
    AddRequired(command, "--out DIR", options->out, out);
    command.add_flag("--json", options->json, "Print JSON (weft.v1.TakeCopy)");
  };
  CLI::App* export_command =
      AddCommand(take, "export",
                 "Write a take as images, <out>/<frame>/<camera>.png, 8 bits as `weft register` reads them; "
                 "as an archive, <out>/<camera>.mkv in FFV1 without loss, checked by decoding it again; or "
                 "as a preview video of all cameras. Videos need the program ffmpeg.",
                 "  weft take export take --out images --demosaic\n"
                 "  weft take export take --out archive --format ffv1\n"
                 "  weft take export take:20260131-104500-1a2b3c4d --server 127.0.0.1:7411 --out images\n"
                 "  weft take export take --out take.mp4 --format proxy");
  add(*export_command, "TAKE", "Folder of the take",
      "Folder of the images or of the archive, file of the video (mp4, mkv)");
  KindOptions add_to_export(*export_command, "take export");
  add_to_export("format", options->format);
  add_to_export("camera-width-px", options->camera_width_px);
  add_to_export("demosaic", options->demosaic);
  RunHereOrAtDaemon(*export_command, line, [options, &line] { return ExportTake(*options, line.quiet); });

  CLI::App* trim =
      AddCommand(take, "trim",
                 "Copy a range of frame sets into a take of its own; numbers, times and bytes stay, but for "
                 "the times of cameras that are shifted.",
                 "  weft take trim take --frames 100:200 --out walk\n"
                 "  weft take trim take:20260131-104500-1a2b3c4d --frames 100:200 --server 127.0.0.1:7411\n"
                 "  weft take trim take --out shifted --shift cam3=-1.5");
  add(*trim, "TAKE", "Folder of the take", "Folder of the new take; a daemon keeps it as a take of its own");
  trim->get_option("--out")->required(false);
  AddTakeRangeOptions(*trim, options->range);
  KindOptions add_to_trim(*trim, "take trim");
  add_to_trim("compress", options->compress);
  RunHereOrAtDaemon(*trim, line, [options, &line]() -> absl::Status {
    if (options->out.empty())
      return absl::InvalidArgumentError("--out is required: the folder of the new take");
    return Trim(*options, line.quiet);
  });
}

}  // namespace weft
