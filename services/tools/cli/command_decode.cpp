// weft decode: from images to observations.
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <filesystem>
#include <map>
#include <numeric>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "base/named_status.h"
#include "base/path_facts.h"
#include "base/stopwatch.h"
#include "capture/image/image_file.h"
#include "pattern/decoder.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/board_file.h"
#include "services/formats/files/observations_file.h"
#include "services/formats/options/presets.h"
#include "services/formats/verdict/grey_levels.h"
#include "services/formats/verdict/verdict.h"
#include "services/ground/process/exit_status.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/decode_inputs.h"
#include "services/tools/cli/decode_overlay.h"
#include "services/tools/cli/input_options.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/cli/pipeline_flags.h"
#include "services/tools/cli/print_verdict.h"
#include "services/tools/cli/progress.h"
#include "services/work/pipeline/stage_reports.h"
#include "weft/v1/command.pb.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

struct DecodeCommandOptions {
  std::vector<std::string> images;
  std::string board;
  std::string out;
  std::string mosaic;
  std::string frames;  // of a take or a folder of images, which is the only one of `images` then
  std::string explain;
  PipelineFlags pipeline;
  int threads = 0;
  bool json = false;
};

// What became of one image.
struct DecodedFile {
  v1::DecodedImage report;
  std::string lines;     // of observations.csv
  absl::Status image;    // of reading and decoding
  absl::Status picture;  // of writing the picture of --explain
};

// Before the work of minutes, not after it.
absl::Status CheckWritable(const std::string& file) {
  if (IsFolder(file)) {
    return absl::InvalidArgumentError(
        absl::StrCat(file, ": --out names a folder; give the name of a file in it"));
  }
  const std::string parent = fs::path(file).parent_path().string();
  const std::string folder = parent.empty() ? "." : parent;
  if (access(folder.c_str(), W_OK) == 0) return absl::OkStatus();
  return absl::PermissionDeniedError(
      absl::StrCat(file, ": the folder ", folder, " cannot be written; choose one that you may write to"));
}

absl::StatusOr<BoardIndex> LoadBoard(const std::string& path) {
  WEFT_ASSIGN_OR_RETURN(const Board board, ReadBoard(path));
  WEFT_ASSIGN_OR_RETURN(BoardIndex index, Naming(path, BoardIndex::Build(board)));
  return index;
}

absl::StatusOr<DecodeResult> DecodeFrame(const absl::StatusOr<Frame>& frame, const BoardIndex& board,
                                         const DecodeOptions& options, v1::DecodedImage& report) {
  if (!frame.ok()) return frame.status();
  report.set_width_px(frame->width_px);
  report.set_height_px(frame->height_px);
  return DecodeView(*frame, board, options);
}

// `picture` is empty where none is wanted.
void DecodeFile(const DecodeInput& input, const BoardIndex& board, const DecodeOptions& options,
                const std::string& picture, DecodedFile& file) {
  const Stopwatch watch;
  file.report.set_path(input.label);
  v1::ViewReport& view = *file.report.mutable_view();
  view.set_camera(input.name);
  const absl::StatusOr<Frame> frame = input.read();
  view.set_read_ms(watch.Ms());
  absl::StatusOr<DecodeResult> result = DecodeFrame(frame, board, options, file.report);
  file.image = result.status();
  if (!result.ok()) {
    view.set_missing_reason(std::string(result.status().message()));
    return;
  }
  DescribeDecoding(*result, view);
  file.report.set_total_ms(watch.Ms());
  if (!picture.empty()) {
    const absl::StatusOr<Frame> drawn = DrawDecoding(*frame, *result);
    file.picture = drawn.ok() ? WriteImageFile(picture, *drawn) : drawn.status();
  }
  file.lines = ObservationLines({input.name, std::move(result->observations)});
}

std::string PictureFile(const DecodeCommandOptions& options, const DecodeInput& input, size_t i) {
  if (options.explain.empty()) return "";
  const std::string stem = fs::path(input.name).stem().string();
  const bool is_dump = options.images.size() == 1 && IsFolder(options.images[0]);
  const std::string name = is_dump              ? absl::StrReplaceAll(input.name, {{"/", "_"}})
                           : input.name == stem ? input.name
                                                : absl::StrCat(i + 1, "_", stem);
  return (fs::path(options.explain) / (name + ".png")).string();
}

// So that no thread is left with a large image while the others have nothing to do.
std::vector<size_t> LargestFirst(const std::vector<DecodeInput>& inputs) {
  std::vector<size_t> order(inputs.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::ranges::stable_sort(order, [&](size_t a, size_t b) { return inputs[a].bytes > inputs[b].bytes; });
  return order;
}

std::vector<DecodedFile> DecodeFiles(const DecodeCommandOptions& options,
                                     const std::vector<DecodeInput>& inputs, const BoardIndex& board,
                                     const DecodeOptions& decode, bool quiet) {
  std::vector<DecodedFile> files(inputs.size());
  Progress progress("decode", inputs.size(), ProgressVisible(quiet));
  const auto threads = options.threads > 0 ? options.threads : tbb::info::default_concurrency();
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<size_t>(threads));
  const std::vector<size_t> order = LargestFirst(inputs);
  std::atomic<size_t> next = 0;
  const auto work = [&](int) {
    for (size_t k = next++; k < order.size(); k = next++) {
      const size_t i = order[k];
      DecodeFile(inputs[i], board, decode, PictureFile(options, inputs[i], i), files[i]);
      if (!files[i].image.ok() && !quiet) {
        progress.PrintLine(absl::StrCat("weft: warning: ", files[i].image.message()));
      }
      progress.Advance();
    }
  };
  const int workers = static_cast<int>(std::min<size_t>(threads, inputs.size()));
  tbb::parallel_for(0, workers, work, tbb::simple_partitioner());
  return files;
}

v1::DecodeReport Summarize(const std::string& out, const std::vector<DecodedFile>& files, double wall_ms) {
  v1::DecodeReport report;
  report.set_observations(out);
  for (const DecodedFile& file : files) {
    *report.add_images() = file.report;
    report.set_images_decoded(report.images_decoded() + file.image.ok());
    report.set_images_failed(report.images_failed() + !file.image.ok());
    report.set_centers(report.centers() + file.report.view().centers());
    report.set_corners(report.corners() + file.report.view().corners());
  }
  report.set_wall_ms(wall_ms);
  return report;
}

// Are these pictures of the board?
void Assess(v1::DecodeReport& report) {
  v1::Verdict& verdict = *report.mutable_verdict();
  if (report.images_failed() > 0) {
    AddFinding(
        verdict, report.images_decoded() > 0 ? v1::GRADE_USABLE : v1::GRADE_BAD,
        absl::StrCat(report.images_failed(), " of ", report.images_size(), " images could not be decoded"),
        "Mend or replace the images that the warnings name.");
  }
  if (report.images_decoded() == 0) return;
  const double cells = static_cast<double>(report.centers()) / report.images_decoded();
  AddCheck(
      verdict, kDecodeCells, cells,
      cells < kDecodeCells.usable
          ? absl::StrCat(report.centers() == 0 ? "no cell" : "hardly any cell", " of the board was decoded, ",
                         report.centers(), " in ", report.images_decoded(), " images: is it the right board?")
          : "");
  std::vector<PrintContrast> pictures;
  for (const v1::DecodedImage& image : report.images())
    pictures.push_back({image.view().camera(), image.view().grey_levels()});
  AddGreyLevelsCheck(verdict, pictures);
}

std::string RejectedText(const std::map<std::string, int>& reasons) {
  int total = 0;
  std::vector<std::string> parts;
  for (const auto& [reason, count] : reasons) {
    total += count;
    parts.push_back(absl::StrCat(reason, " ", count));
  }
  return parts.empty() ? "0" : absl::StrCat(total, ": ", absl::StrJoin(parts, ", "));
}

void PrintTable(const v1::DecodeReport& report) {
  int width = 5, accepted = 0;
  double total_ms = 0;
  std::map<std::string, int> rejected;
  for (const v1::DecodedImage& image : report.images()) {
    width = std::max(width, static_cast<int>(image.view().camera().size()));
  }
  std::printf("%-*s  %11s  %7s  %7s  %7s  %8s  %s\n", width, "image", "px", "cells", "corners", "ms",
              "accepted", "rejected patches");
  for (const v1::DecodedImage& image : report.images()) {
    const v1::ViewReport& view = image.view();
    if (!view.missing_reason().empty()) {
      std::printf("%-*s  failed: %s\n", width, view.camera().c_str(), view.missing_reason().c_str());
      continue;
    }
    std::map<std::string, int> reasons;
    for (const v1::ReasonCount& one : view.patches_rejected()) reasons[one.reason()] = one.count();
    const std::string size = absl::StrCat(image.width_px(), "x", image.height_px());
    std::printf("%-*s  %11s  %7d  %7d  %7.0f  %8d  %s\n", width, view.camera().c_str(), size.c_str(),
                view.centers(), view.corners(), image.total_ms(), view.patches_accepted(),
                RejectedText(reasons).c_str());
    accepted += view.patches_accepted();
    total_ms += image.total_ms();
    for (const auto& [reason, count] : reasons) rejected[reason] += count;
  }
  std::printf("%-*s  %11s  %7d  %7d  %7.0f  %8d  %s\n", width, "total",
              absl::StrCat(report.images_decoded(), " images").c_str(), report.centers(), report.corners(),
              total_ms, accepted, RejectedText(rejected).c_str());
  std::printf("%s: written in %.1f s\n", report.observations().c_str(), report.wall_ms() / 1000);
}

// The error that stands at the end when images were left out.
absl::Status LeftOut(const std::vector<DecodedFile>& files, const std::string& out) {
  size_t failed = 0;
  const DecodedFile* first = nullptr;
  for (const DecodedFile& file : files) {
    if (file.image.ok()) continue;
    if (failed++ == 0) first = &file;
  }
  if (failed == 0) return absl::OkStatus();
  const std::string rest =
      failed == files.size() ? absl::StrCat(out, " was not written") : absl::StrCat(out, " holds the others");
  return absl::InvalidArgumentError(
      absl::StrCat(failed, " of ", files.size(), " images could not be decoded, ", rest,
                   failed > 1 ? "; the first: " : ": ", first->image.message()));
}

absl::Status DecodeImages(const DecodeCommandOptions& options, bool quiet) {
  const Stopwatch watch;
  WEFT_ASSIGN_OR_RETURN(CommandPipeline pipeline,
                        MakeCommandPipeline(kDefaultPreset, options.pipeline, {"decode"}));
  pipeline.options.decode.explain = !options.explain.empty();
  WEFT_ASSIGN_OR_RETURN(const auto inputs, FindDecodeInputs(options.images, options.frames, options.mosaic));
  for (const std::string& note : inputs.notes) PrintWarning(note);
  WEFT_RETURN_IF_ERROR(CheckWritable(options.out));
  WEFT_ASSIGN_OR_RETURN(const BoardIndex board, LoadBoard(options.board));
  if (!options.explain.empty()) {
    WEFT_RETURN_IF_ERROR(CreateFolders(options.explain));
  }
  std::vector<DecodedFile> files = DecodeFiles(options, inputs.views, board, pipeline.options.decode, quiet);

  std::vector<std::string> found;
  for (DecodedFile& file : files) {
    if (file.image.ok()) found.push_back(std::move(file.lines));
  }
  if (!found.empty()) {
    WEFT_RETURN_IF_ERROR(WriteFileAtomically(options.out, ObservationsCsv(found)));
  }
  v1::DecodeReport report = Summarize(found.empty() ? "" : options.out, files, watch.Ms());
  *report.mutable_options() = pipeline.message;
  Assess(report);
  if (options.json) {
    WEFT_RETURN_IF_ERROR(PrintJsonMessage(report));
  } else if (!found.empty()) {
    if (report.verdict().grade() != v1::GRADE_GOOD) PrintVerdict(report.verdict());
    PrintTable(report);
  }
  for (const DecodedFile& file : files) {
    if (!file.picture.ok()) return file.picture;
  }
  absl::Status status = LeftOut(files, options.out);
  status.Update(VerdictStatus(report.verdict()));
  return status;
}

}  // namespace

void AddDecodeCommand(CLI::App& app, CommandLine& line) {
  const auto [command, options] = AddCommand<DecodeCommandOptions>(
      app, line, DecodeImages, "decode",
      "Find the cells of a board in images and write them as observations: "
      "image,x_px,y_px,board_row,board_col,kind,confidence,sigma_px. `image` is the file name without "
      "folder and ending, or the path where names repeat; of a take or folder the camera, or "
      "<frame>/<camera>. An image "
      "that cannot be decoded is reported and left out, with exit status 2.",
      "  weft decode dump/0000/*.jpg --board board.png --out observations.csv\n"
      "  weft decode take --frames 120 --board board.json --out observations.csv\n"
      "  weft decode raw.png --mosaic bayer_rg8 --board board.json --out raw.csv --explain pictures");
  AddRequired(*command, "IMAGE", options->images, "PNG, JPEG or TIFF images; or a take or folder of images");
  AddFramesOption(*command, options->frames,
                  "Which frames of a take or folder of images, with all their cameras", "--frame");
  AddRequired(*command, "--board BOARD", options->board, "board.json or board.png of the cloth");
  AddRequired(*command, "--out FILE", options->out, "The observations.csv to write");
  AddMosaicOption(*command, options->mosaic);
  AddPipelineFlags(*command, options->pipeline);
  AddOption(*command, "--explain DIR", options->explain,
            "Write a picture per image to this folder: cells as dots in the colour of their patch, crosses "
            "where the search along the board stopped, rejected patches in boxes with the reason, and a "
            "legend with counts");
  AddOption(*command, "--threads N", options->threads, "Images at a time; 0 for all cores",
            CLI::Range(0, 4096));
  command->add_flag("--json", options->json, "Print JSON (weft.v1.DecodeReport)");
}

}  // namespace weft
