// weft rig target, rehearse, calibrate: from boards to a calibrated rig.
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/target_file.h"
#include "services/formats/verdict/verdict.h"
#include "services/ground/process/exit_status.h"
#include "services/studio/calibration/calibrate_dump.h"
#include "services/studio/calibration/rehearsal.h"
#include "services/studio/calibration/target_print.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/input_options.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/cli/kind_options.h"
#include "services/tools/cli/output_guard.h"
#include "services/tools/cli/print_verdict.h"
#include "services/tools/cli/progress.h"
#include "services/tools/cli/remote_operation.h"

namespace weft {
namespace {

struct TargetOptions {
  TagBoard shape{.id = "", .rows = 8, .cols = 6, .tag_mm = 40};
  double gap_mm = 0;
  int boards = 1;
  int first_id = 0;
  std::vector<std::string> bars;
  std::string id = "target";
  std::string out;
  OutputGuard guard;
};

// "FIRST:SECOND:MM".
absl::StatusOr<ScaleBar> ParseBar(const std::string& text, const std::string& family, size_t number) {
  const std::vector<std::string> parts = absl::StrSplit(text, ':');
  ScaleBar bar{absl::StrCat("bar", number), family};
  if (parts.size() != 3 || !absl::SimpleAtoi(parts[0], &bar.first_tag) ||
      !absl::SimpleAtoi(parts[1], &bar.second_tag) || !absl::SimpleAtod(parts[2], &bar.length_mm)) {
    return absl::InvalidArgumentError(
        absl::StrCat("--bar ", text, ": expected FIRST_TAG:SECOND_TAG:LENGTH_MM, such as 500:501:1000"));
  }
  return bar;
}

absl::Status WritePrint(const std::string& stem, const TagBoard& board) {
  const absl::Status status = WriteBoardPrint(board, stem);
  if (status.ok()) std::printf("print    %s.pdf (and .svg), at true scale\n", stem.c_str());
  return status;
}

// Prints are glued to boards, and tag_mm is corrected by hand: the file cannot be made again.
absl::Status MayWriteTarget(const std::filesystem::path& folder, const CalibrationTarget& target,
                            const OutputGuard& guard) {
  const std::string file = (folder / "target.json").string();
  const absl::StatusOr<CalibrationTarget> before = ReadTarget(file);
  if (before.ok() && *before == target) return absl::OkStatus();
  return guard.MayReplace(file, "a target, whose boards may be printed");
}

absl::Status MakeTarget(const TargetOptions& options) {
  CalibrationTarget target;
  target.id = options.id;
  const int tags = options.shape.rows * options.shape.cols;
  for (int b = 0; b < options.boards; ++b) {
    TagBoard board = options.shape;
    board.id = std::string(1, static_cast<char>('A' + b));
    board.gap_mm = options.gap_mm;
    if (const auto family = FindTagFamily(board.family); options.gap_mm == 0 && family) {
      board.gap_mm = board.tag_mm * (family->width_modules - family->border_modules) / family->border_modules;
    }
    for (int i = 0; i < tags; ++i) board.tag_ids.push_back(options.first_id + b * tags + i);
    target.boards.push_back(board);
  }
  for (size_t i = 0; i < options.bars.size(); ++i) {
    WEFT_ASSIGN_OR_RETURN(ScaleBar bar, ParseBar(options.bars[i], options.shape.family, i + 1));
    target.scale_bars.push_back(std::move(bar));
  }
  WEFT_RETURN_IF_ERROR(target.Validate());
  const std::filesystem::path out(options.out);
  WEFT_RETURN_IF_ERROR(MayWriteTarget(out, target, options.guard));
  WEFT_RETURN_IF_ERROR(CreateFolders(options.out));
  WEFT_RETURN_IF_ERROR(WriteTarget((out / "target.json").string(), target));
  absl::Status status;
  std::printf("target   %s\n", (out / "target.json").c_str());
  for (const TagBoard& board : target.boards)
    status.Update(WritePrint((out / ("board_" + board.id)).string(), board));
  for (const ScaleBar& bar : target.scale_bars) {
    for (const int tag : {bar.first_tag, bar.second_tag}) {
      const TagBoard single{absl::StrCat(bar.id, " tag ", tag),
                            bar.family,
                            1,
                            1,
                            options.shape.tag_mm,
                            target.boards[0].gap_mm,
                            {tag}};
      status.Update(WritePrint((out / absl::StrCat(bar.id, "_tag", tag)).string(), single));
    }
  }
  return status;
}

void AddTargetCommand(CLI::App& rig, CommandLine& line) {
  const auto [command, options] = AddCommand<TargetOptions>(
      rig, line, MakeTarget, "target",
      "Boards of AprilTags to calibrate a rig with: target.json, and every board as PDF and SVG at true "
      "scale. Glue the print on something flat and stiff, measure a tag, and correct tag_mm in target.json "
      "where the printer was off.",
      "  weft rig target --rows 8 --cols 6 --tag-mm 40 --out target\n"
      "  weft rig target --rows 8 --cols 6 --tag-mm 40 --boards 2 --bar 500:501:1000 --out target");
  AddOption(*command, "--rows N", options->shape.rows, "Rows of tags", CLI::Range(1, 100));
  AddOption(*command, "--cols N", options->shape.cols, "Columns of tags", CLI::Range(1, 100));
  AddOption(*command, "--tag-mm MM", options->shape.tag_mm, "Side of a tag's border square",
            CLI::PositiveNumber);
  AddOption(*command, "--gap-mm MM", options->gap_mm,
            "Between border squares; 0: as little as the family allows", CLI::NonNegativeNumber);
  AddOption(*command, "--family NAME", options->shape.family, "tag36h11 or tagStandard41h12");
  AddOption(*command, "--boards N", options->boards, "Boards, each with tags of its own", CLI::Range(1, 26));
  AddOption(*command, "--first-id N", options->first_id, "Id of the first tag", CLI::NonNegativeNumber);
  AddOption(*command, "--bar TAG:TAG:MM", options->bars,
            "A scale bar: two tags whose centres are so far apart; may be repeated");
  AddOption(*command, "--id NAME", options->id, "Name of the target, kept in the file");
  AddRequired(*command, "--out DIR", options->out, "Folder for the files, made where it is missing");
  options->guard.AddTo(*command);
}

struct RehearseOptions {
  std::string target;
  RehearsalOptions rehearsal;
  std::string out;
  int threads = 0;
};

absl::Status Rehearse(const RehearseOptions& options, bool quiet) {
  WEFT_ASSIGN_OR_RETURN(const CalibrationTarget target, ReadTarget(options.target));
  WEFT_RETURN_IF_ERROR(WithBar("render", quiet, options.threads, [&](const auto& tell) {
    return WriteRehearsal(options.out, target, options.rehearsal, tell);
  }));
  std::printf("dump     %s\ntruth    %s/truth/rig.json\n", options.out.c_str(), options.out.c_str());
  return absl::OkStatus();
}

void AddRehearseCommand(CLI::App& rig, CommandLine& line) {
  const auto [command, options] = AddCommand<RehearseOptions>(
      rig, line, Rehearse, "rehearse",
      "Render what a simulated rig would record of a target that is moved through its volume, to try "
      "calibration and to see how many frames it takes. The rig that took the images is written beside them.",
      "  weft rig rehearse --target target/target.json --cameras 8 --frames 60 --out boards\n"
      "  weft rig calibrate boards --target target/target.json --out rig.json");
  RehearsalOptions& r = options->rehearsal;
  r.rig = {.cameras = 8,
           .width_px = 1280,
           .height_px = 1024,
           .distance_mm = 2500,
           .object_width_mm = 900,
           .object_height_mm = 700};
  r.motion = {.frames = 60, .reach_mm = {250, 200, 250}};
  AddRequired(*command, "--target FILE", options->target, "target.json");
  AddOption(*command, "--cameras N", r.rig.cameras, "Cameras around the volume", CLI::Range(2, 250));
  AddOption(*command, "--frames N", r.motion.frames, "Moments", CLI::Range(1, 10000));
  AddOption(*command, "--width-px PX", r.rig.width_px, "Width of the images", CLI::Range(64, 8192));
  AddOption(*command, "--height-px PX", r.rig.height_px, "Height of the images", CLI::Range(64, 8192));
  AddOption(*command, "--distance-mm MM", r.rig.distance_mm, "Cameras to the middle", CLI::PositiveNumber);
  AddOption(*command, "--focal-spread SHARE", r.rig.focal_spread,
            "The longest lens is longer than the shortest by this share", CLI::NonNegativeNumber);
  AddOption(*command, "--blur-px PX", r.look.blur_along_px, "Motion blur of every image",
            CLI::NonNegativeNumber);
  AddOption(*command, "--seed N", r.motion.seed, "Of the motion");
  AddRequired(*command, "--out DIR", options->out, "Folder of the dump");
  AddOption(*command, "--threads N", options->threads, "Threads; 0 takes all cores", CLI::Range(0, 1024));
}

struct CalibrateOptions {
  CalibrationRequest request;
  std::string scale = "tags";
  int threads = 0;
  bool json = false;
};

absl::Status Calibrate(CalibrateOptions& options, bool quiet) {
  options.request.solve.scale_from_bar = options.scale == "bar";
  const absl::StatusOr<CalibrationResult> result =
      WithStageBars(quiet, options.threads, [&](StageBars& bars) {
        return CalibrateDump(options.request,
                             [&](const std::string& stage, double share) { bars.SetShare(stage, share); });
      });
  if (!result.ok()) return result.status();
  const std::string& out = options.request.out;
  WEFT_RETURN_IF_ERROR(WriteCalibration(out, *result));
  if (!quiet && !result->detection.warnings.empty()) {
    PrintWarning(absl::StrCat(result->detection.warnings.size(),
                              " images could not be read, the first: ", result->detection.warnings[0]));
  }
  const v1::Verdict verdict = CalibrationVerdict(*result);
  if (options.json) {
    WEFT_RETURN_IF_ERROR(PrintJsonMessage(CalibrationMessage(*result)));
    return VerdictStatus(verdict);
  }
  PrintVerdict(verdict);
  const std::string headline = CalibrationHeadline(*result);
  if (headline != verdict.reason()) std::printf("%s\n", headline.c_str());
  for (size_t i = 1; i < result->issues.size(); ++i)
    std::printf("besides  %s\n", result->issues[i].message.c_str());
  if (result->issues.empty())
    std::printf("rig      %s (version %d, hash %s)\n", out.c_str(), result->record.version,
                result->rig.ContentHash().c_str());
  else
    std::printf("rig      %s was not written\n", out.c_str());
  std::printf("report   %s\n", CalibrationReportPath(out).c_str());
  return VerdictStatus(verdict);
}

void AddCalibrateCommand(CLI::App& rig, CommandLine& line) {
  CLI::App* command =
      AddCommand(rig, "calibrate",
                 "Calibrate the cameras of a rig from a dump in which boards of a target are moved through "
                 "the volume: lenses, poses, their sigmas, and a page to look at. Cameras need not share one "
                 "view: it is enough that each sees boards together with some other. A calibration that "
                 "cannot be trusted is refused, with the camera, the cause and the remedy.",
                 "  weft rig calibrate boards --target target/target.json --out rig.json\n"
                 "  weft rig calibrate boards --target target/target.json --world-frame 0012 --world-floor "
                 "--scale bar --out rig.json");
  auto options = std::make_shared<CalibrateOptions>();
  CalibrationRequest& request = options->request;
  KindOptions add(*command, "rig calibrate");
  add("dump", request.dump);
  add("target", request.target);
  AddRequired(*command, "--out FILE", request.out, "The rig.json to write; its page stands beside it");
  AddFramesOption(*command, request.frames, "Which frames of the dump, all by default");
  AddMosaicOption(*command, request.mosaic);
  add("every", request.every);
  add("min-views", request.checks.min_views);
  add("rig", request.initial_rig);
  add("id", request.rig_id);
  add("world-frame", request.solve.world_frame);
  add("world-board", request.solve.world_board);
  add("world-floor", request.solve.world_on_floor);
  add("scale", options->scale);
  add("gamma", request.detection.gamma);
  add("max-blur-px", request.detection.max_blur_px);
  add("max-rms-px", request.checks.max_rms_px);
  add("max-stage-sigma-px", request.checks.max_projection_sigma_px);
  AddOption(*command, "--threads N", options->threads, "Threads; 0 takes all cores", CLI::Range(0, 1024));
  command->add_flag("--json", options->json, "Print JSON (weft.v1.CalibrationReport)");
  RunHereOrAtDaemon(*command, line, [options, &line] { return Calibrate(*options, line.quiet); });
}

}  // namespace

void AddRigCalibrateCommands(CLI::App& rig, CommandLine& line) {
  AddTargetCommand(rig, line);
  AddRehearseCommand(rig, line);
  AddCalibrateCommand(rig, line);
}

}  // namespace weft
