// weft take import: takes from folders of images and from videos.
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/path_facts.h"
#include "capture/image/frame.h"
#include "services/ground/process/exit_status.h"
#include "services/ground/process/stop_on_signal.h"
#include "services/studio/recording/take_copy.h"
#include "services/studio/video/import_videos.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/cli/progress.h"
#include "services/tools/cli/take_text.h"
#include "weft/v1/replay.pb.h"

namespace weft {
namespace {

struct ImportCommandOptions {
  std::vector<std::string> sources, cameras, offsets, ltc;
  std::string out, mosaic, sync = "auto", names = "auto";
  VideoImportOptions video;
  std::string slate, name, notes;
  double fps = 0;
  bool compress = false;
  bool json = false;
};

absl::StatusOr<std::optional<PixelFormat>> MosaicOf(const ImportCommandOptions& options) {
  if (options.mosaic.empty()) return std::optional<PixelFormat>();
  WEFT_ASSIGN_OR_RETURN(const PixelFormat mosaic, PixelFormatFromName(options.mosaic));
  return std::optional<PixelFormat>(mosaic);
}

absl::Status SayImported(const ImportCommandOptions& options, v1::TakeCopy copy, const std::string& text) {
  if (options.json) {
    copy.set_source(options.sources.empty() ? options.cameras.front() : options.sources.front());
    copy.set_out(options.out);
    return PrintJsonMessage(copy);
  }
  std::fputs(text.c_str(), stdout);
  for (const std::string& warning : copy.warnings()) PrintWarning(warning);
  return absl::OkStatus();
}

absl::Status ImportFolder(const ImportCommandOptions& options, bool quiet) {
  TakeCopyOptions copy;
  copy.fps = options.fps;
  copy.recorder.take.stream.compress = options.compress;
  WEFT_ASSIGN_OR_RETURN(copy.mosaic, MosaicOf(options));
  const absl::StatusOr<NameMeaning> names = NameMeaningFromName(options.names);
  if (!names.ok()) return absl::InvalidArgumentError(absl::StrCat("--", names.status().message()));
  copy.names = *names;
  Progress bar("import", 0, ProgressVisible(quiet));
  WEFT_ASSIGN_OR_RETURN(const ImportedImages imported,
                        ImportImages(options.sources.front(), options.out, copy,
                                     [&](uint64_t done, uint64_t total) { bar.Set(done, total); }));
  v1::TakeCopy said;
  said.set_sets(imported.sets);
  said.mutable_warnings()->Assign(imported.notes.begin(), imported.notes.end());
  return SayImported(options, said, absl::StrFormat("%s: %d frame sets\n", options.out, imported.sets));
}

// "NAME=TEXT". InvalidArgument names the option.
absl::StatusOr<std::pair<std::string, std::string>> NameAndText(const char* option,
                                                                const std::string& given) {
  const size_t equals = given.find('=');
  if (equals != std::string::npos && equals > 0 && equals + 1 < given.size())
    return std::pair(given.substr(0, equals), given.substr(equals + 1));
  return absl::InvalidArgumentError(absl::StrCat(option, " ", given, ": must be NAME=..."));
}

absl::StatusOr<VideoImportOptions> VideoOptionsOf(const ImportCommandOptions& options) {
  if (options.fps != 0 || options.names != "auto")
    return absl::InvalidArgumentError("--fps and --names are for images; videos say their times");
  VideoImportOptions video = options.video;
  for (const std::string& path : options.sources)
    video.videos.push_back({std::filesystem::path(path).stem().string(), path});
  for (const std::string& given : options.cameras) {
    WEFT_ASSIGN_OR_RETURN(const auto parts, NameAndText("--camera", given));
    video.videos.push_back({parts.first, parts.second});
  }
  for (const std::string& given : options.ltc) {
    WEFT_ASSIGN_OR_RETURN(const auto parts, NameAndText("--ltc", given));
    video.ltc[parts.first] = parts.second;
  }
  for (const std::string& given : options.offsets) {
    WEFT_ASSIGN_OR_RETURN(const auto parts, NameAndText("--offset", given));
    if (!absl::SimpleAtod(parts.second, &video.given_s[parts.first]))
      return absl::InvalidArgumentError(absl::StrCat("--offset ", given, ": seconds are wanted"));
  }
  const absl::StatusOr<SyncWay> sync = SyncWayFromName(options.sync);
  if (!sync.ok()) return absl::InvalidArgumentError(absl::StrCat("--", sync.status().message()));
  video.sync = *sync;
  WEFT_ASSIGN_OR_RETURN(video.mosaic, MosaicOf(options));
  video.stream.compress = options.compress;
  video.said.set_slate(options.slate);
  video.said.set_name(options.name);
  video.said.set_notes(options.notes);
  return video;
}

// Stops where `stop` is requested.
VideoImportProgress BarPerStage(bool quiet, const std::stop_token& stop) {
  const auto bars = std::make_shared<StageBars>(quiet);
  return [bars, stop](const char* stage, uint64_t done, uint64_t total) {
    bars->Set(stage, done, total);
    return !stop.stop_requested();
  };
}

absl::Status ImportFilms(const ImportCommandOptions& options, bool quiet) {
  WEFT_ASSIGN_OR_RETURN(const VideoImportOptions video, VideoOptionsOf(options));
  const StopOnSignal signals;
  const absl::StatusOr<VideoImportResult> result =
      ImportVideos(video, options.out, BarPerStage(quiet, signals.token()));
  if (absl::IsCancelled(result.status()))
    return absl::CancelledError("stopped; the same command goes on from here");
  if (!result.ok()) return result.status();
  v1::TakeCopy said;
  said.set_sets(result->take.sets_recorded());
  *said.mutable_take() = result->take;
  said.mutable_warnings()->Assign(result->warnings.begin(), result->warnings.end());
  std::string text =
      absl::StrFormat("%s: %d frame sets of %d cameras, %s\n", options.out, result->take.sets_recorded(),
                      result->take.cameras_size(), result->take.sync());
  if (!result->take.timecode().empty())
    absl::StrAppend(&text, "timecode of the first: ", result->take.timecode(), "\n");
  return SayImported(options, said, text + VideoSyncText(result->take));
}

absl::Status Import(const ImportCommandOptions& options, bool quiet) {
  const bool is_folder =
      options.sources.size() == 1 && options.cameras.empty() && !IsRegularFile(options.sources.front());
  if (!is_folder) return ImportFilms(options, quiet);
  const VideoImportOptions& video = options.video;
  if (!video.rig.empty() || !video.board.empty() || options.sync != "auto" || !options.offsets.empty())
    return absl::InvalidArgumentError(absl::StrCat(
        options.sources.front(), ": a folder of images; --rig, --board, --sync and --offset are for videos"));
  return ImportFolder(options, quiet);
}

void AddVideoOptions(CLI::App& command, ImportCommandOptions& options) {
  AddOption(command, "--camera NAME=FILE", options.cameras,
            "A video whose name is not that of its camera; repeat it");
  AddOption(command, "--rig FILE", options.video.rig,
            "rig.json: the cameras, and how large their pictures are");
  AddOption(command, "--board FILE", options.video.board,
            "board.json: with the rig, motion tells the offsets");
  AddOption(command, "--sync WAY", options.sync,
            "What tells when the videos were filmed: auto (timecode, of their sound too, else motion), "
            "timecode, ltc (timecode in their sound), motion, file-times or together");
  AddOption(command, "--ltc NAME=FILE", options.ltc,
            "A sound file with linear timecode that begins with a camera's video; repeat it");
  AddOption(command, "--offset NAME=S", options.offsets,
            "Seconds to add to the times of a camera's video, where they are known; repeat it");
  AddOption(command, "--max-offset-s S", options.video.max_offset_s,
            "How far apart motion looks for the moments of two cameras", CLI::Range(0.05, 30.0));
  AddOption(command, "--slate TEXT", options.slate, "What the take is called on the set");
  AddOption(command, "--name TEXT", options.name, "What you call the take");
  AddOption(command, "--notes TEXT", options.notes, "What else should be known of it");
}

}  // namespace

void AddTakeImportCommand(CLI::App& take, CommandLine& line) {
  const auto options = std::make_shared<ImportCommandOptions>();
  CLI::App* command = AddCommand(
      take, "import",
      "Make a take of a folder of images, without loss, or of videos, one per camera (MP4, MOV, MKV and what "
      "else ffmpeg reads). Videos are put in step by their timecode or, with a rig and a board, by the "
      "motion of the print; offsets and how sure they are is printed. What cannot be read is missing in the "
      "take, with the reason. An import of videos that was cut off goes on when it is called again.",
      "  weft take import dump --out take --fps 30\n"
      "  weft take import cam1.mp4 cam2.mp4 --rig rig.json --board board.json --out take\n"
      "  weft take import --camera left=GX01.MP4 --camera right=GX02.MP4 --sync timecode --out take");
  AddOption(*command, "SOURCE", options->sources,
            "A folder with <frame>/<camera>.png or cam<camera>/image<frame>.png, or <camera>/<frame>.png "
            "where names tell, or videos named like their cameras");
  AddRequired(*command, "--out DIR", options->out, "Folder of the new take");
  command->add_flag("--json", options->json, "Print JSON (weft.v1.TakeCopy)");
  command->add_flag("--compress", options->compress,
                    "Planes apart, predictor and zstd: lossless, half the size, a core's work");
  AddOption(*command, "--fps N", options->fps,
            "Frames per second of images, for the times of the frames; 0: no times but those in the names of "
            "frames");
  AddOption(*command, "--names KIND", options->names,
            "What the names of frames are: numbers; times in s, ms, us or ns; clock (101502033 or "
            "2021-06-16_10-15-02.033); auto: as their steps and --fps tell, which is said");
  AddOption(*command, "--mosaic ORDER", options->mosaic, "Grey images are a Bayer mosaic of this order");
  AddVideoOptions(*command, *options);
  command->callback([options, &line] {
    if (options->sources.empty() && options->cameras.empty())
      throw CLI::RequiredError("SOURCE, or --camera NAME=FILE");
    line.run = [options, &line] { return Import(*options, line.quiet); };
  });
}

}  // namespace weft
