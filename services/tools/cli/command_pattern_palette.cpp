// weft pattern palette: how well printed inks separate under a light.
#include <cstdio>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/named_status.h"
#include "capture/image/image_file.h"
#include "pattern/decoder.h"
#include "pattern/image/ink_palette.h"
#include "services/formats/files/board_file.h"
#include "services/studio/print/palette_picture.h"
#include "services/tools/cli/commands.h"

namespace weft {
namespace {

struct PaletteCommandOptions {
  std::string photo;
  std::string board;
  std::vector<double> swatches;
  std::string picture;
  bool json = false;
};

std::string Name(CellColor color) { return std::string(CellColorName(color)); }

absl::StatusOr<std::vector<PaletteSample>> Samples(const PaletteCommandOptions& options) {
  if (options.board.empty() == options.swatches.empty())
    return absl::InvalidArgumentError(
        "give either --board, for a photograph of the printed board, or --swatches, for one of a print's "
        "head");
  WEFT_ASSIGN_OR_RETURN(const Frame photo, ReadImageFile(options.photo));
  if (!options.swatches.empty()) {
    const std::vector<double>& s = options.swatches;
    return SampleSwatches(photo, {s[0], s[1]}, {s[2], s[3]});
  }
  WEFT_ASSIGN_OR_RETURN(const Board board, ReadBoard(options.board));
  WEFT_ASSIGN_OR_RETURN(const BoardIndex index, BoardIndex::Build(board));
  WEFT_ASSIGN_OR_RETURN(const DecodeResult decoded, DecodeView(photo, index, DecodeOptions{}));
  return SampleCells(photo, board, decoded.observations);
}

std::string Json(const PaletteReport& report) {
  std::string out = "{\"inks\": [";
  for (int k = 0; k < kCellColors; ++k) {
    const PaletteInk& ink = report.inks[k];
    absl::StrAppendFormat(&out, "%s{\"color\": \"%s\", \"samples\": %d, \"mean\": [%.2f, %.2f, %.2f]}",
                          k ? ", " : "", Name(static_cast<CellColor>(k)), ink.samples, ink.mean[0],
                          ink.mean[1], ink.mean[2]);
  }
  const auto table = [&](const char* name, const auto& values) {
    absl::StrAppend(&out, ", \"", name, "\": [");
    for (int a = 0; a < kCellColors; ++a) {
      out += a ? ", [" : "[";
      for (int b = 0; b < kCellColors; ++b)
        absl::StrAppendFormat(&out, "%s%.5f", b ? ", " : "", values[a][b]);
      out += "]";
    }
    out += "]";
  };
  out += "]";
  table("separation", report.separation);
  table("confusion", report.confusion);
  absl::StrAppend(&out, ", \"weakest\": [\"", Name(report.weakest_a), "\", \"", Name(report.weakest_b),
                  "\"], \"change\": \"", Name(report.change), "\"}");
  return out;
}

// What to do, in words.
std::string Advice(const PaletteReport& report) {
  const int a = static_cast<int>(report.weakest_a), b = static_cast<int>(report.weakest_b);
  const double least = report.separation[a][b];
  std::string out = absl::StrFormat("weakest pair: %s and %s, %.1f apart", Name(report.weakest_a),
                                    Name(report.weakest_b), least);
  if (least >= kSafeSeparation) return out + "; all inks separate well\n";
  const CellColor other = report.change == report.weakest_a ? report.weakest_b : report.weakest_a;
  const Rgb &own = report.inks[static_cast<int>(report.change)].mean,
            &near = report.inks[static_cast<int>(other)].mean;
  int channel = 0;
  for (int c = 1; c < 3; ++c)
    if (std::abs(own[c] - near[c]) > std::abs(own[channel] - near[channel])) channel = c;
  static constexpr const char* kChannels[] = {"red", "green", "blue"};
  absl::StrAppendFormat(&out, "; change %s: %s %s in it moves it away from %s\n", Name(report.change),
                        own[channel] < near[channel] ? "less" : "more", kChannels[channel], Name(other));
  return out;
}

void PrintPaletteReport(const PaletteReport& report) {
  std::printf("%-9s%8s%20s  separation from", "ink", "samples", "red green blue");
  std::printf("\n%37s", "");
  for (int k = 0; k < kCellColors; ++k) std::printf("%9s", Name(static_cast<CellColor>(k)).c_str());
  std::printf("%12s\n", "read right");
  for (int a = 0; a < kCellColors; ++a) {
    const PaletteInk& ink = report.inks[a];
    std::printf("%-9s%8d%8.0f%6.0f%6.0f", Name(static_cast<CellColor>(a)).c_str(), ink.samples, ink.mean[0],
                ink.mean[1], ink.mean[2]);
    for (int b = 0; b < kCellColors; ++b)
      std::printf("%9s", report.separation[a][b] > 0
                             ? absl::StrFormat("%.1f", report.separation[a][b]).c_str()
                             : "-");
    std::printf("%10.2f %%\n", 100 * report.confusion[a][a]);
  }
  std::printf("%s", Advice(report).c_str());
}

absl::Status Palette(const PaletteCommandOptions& options) {
  const absl::StatusOr<std::vector<PaletteSample>> samples = Samples(options);
  if (!samples.ok()) {
    const std::string why(samples.status().message());
    return absl::Status(samples.status().code(), why.find(options.photo) == std::string::npos
                                                     ? absl::StrCat(options.photo, ": ", why)
                                                     : why);
  }
  WEFT_ASSIGN_OR_RETURN(const PaletteReport report, Naming(options.photo, AssessPalette(*samples)));
  if (options.json) {
    std::printf("%s\n", Json(report).c_str());
  } else {
    PrintPaletteReport(report);
  }
  return options.picture.empty() ? absl::OkStatus() : WritePalettePicture(report, options.picture);
}

}  // namespace

void AddPatternPaletteCommand(CLI::App& pattern, CommandLine& line) {
  const auto [palette, options] = AddCommand<PaletteCommandOptions>(
      pattern, line, Palette, "palette",
      "From a photograph under the studio's light: how well the printed inks separate, and which "
      "to change. Distances of two inks are in units of their scatter; below 4 they are easily "
      "mistaken for each other, above 6 hardly ever.",
      "  weft pattern palette cloth.png --board shirt_board --picture inks.png\n"
      "  weft pattern palette head.jpg --swatches 212 340 1544 361");
  AddRequired(*palette, "PHOTO", options->photo, "A photograph of the print, not white-balanced by pieces");
  AddOption(*palette, "--board BOARD", options->board, "The board that it shows: its cells are the samples");
  palette
      ->add_option("--swatches", options->swatches,
                   "Pixel of the middle of the red and of the black swatch at the head of the print")
      ->expected(4)
      ->type_name("X Y X Y");
  AddOption(*palette, "--picture FILE.png", options->picture, "Write the table as a picture");
  palette->add_flag("--json", options->json, "Print JSON");
}

}  // namespace weft
