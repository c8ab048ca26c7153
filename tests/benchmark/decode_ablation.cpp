// What each step of the decoder is worth: every step that an option can take out is taken out alone, and what
// is lost is printed beside it. `ablation_decode --help` teaches its use.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/median.h"
#include "capture/image/image_file.h"
#include "services/formats/files/board_file.h"
#include "services/formats/files/observations_file.h"
#include "tests/benchmark/decode_score.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using testing::DecodeScore;

// The decoder without a step.
struct Variant {
  const char* name;  // of files, too
  const char* about;
  std::function<void(DecodeOptions*)> change;
};

// The last step first: with --cumulative a step goes after all that build on it.
const std::vector<Variant>& Variants() {
  static const std::vector<Variant> variants = {
      {"no_final_drop", "cells stay however unsure",
       [](DecodeOptions* o) { o->confidence.min_to_stay = o->confidence.min_to_help = 0; }},
      {"no_unsure_helpers", "unsure cells go before the last fit, not after it",
       [](DecodeOptions* o) { o->confidence.min_to_help = o->confidence.min_to_stay; }},
      {"no_component_filter", "cells stay in components of any size (of up to a thousand cells)",
       [](DecodeOptions* o) { o->confidence.min_component = 1; }},
      {"boundary_holes_only", "boundary growth fills holes with all eight neighbours known",
       [](DecodeOptions* o) { o->growth.min_known_at_boundary = 8; }},
      {"no_boundary_eviction", "unsure cells stay before growth at boundaries",
       [](DecodeOptions* o) { o->confidence.min_at_boundary = 0; }},
      {"no_isolated_components", "blobs off the lattice are not read",
       [](DecodeOptions* o) { o->isolated.min_evidence = 1e9f; }},
      {"no_eviction", "unsure cells stay before growth goes on",
       [](DecodeOptions* o) { o->confidence.min_to_grow = 0; }},
      {"no_order_of_growth", "what is not clear does not wait for what is",
       [](DecodeOptions* o) { o->growth.clearly_explained = 0; }},
      {"any_explained_share", "growth takes what the print hardly explains",
       [](DecodeOptions* o) { o->growth.fit.min_explained = 0.01f; }},
      {"any_move", "growth takes what is up to a cell from where it was predicted",
       [](DecodeOptions* o) { o->growth.fit.max_move_cells = 1; }},
      {"one_iteration", "cells are fitted by a single step",
       [](DecodeOptions* o) { o->growth.fit.iterations = 1; }},
      {"any_contradiction", "patches stand whatever the cells around say",
       [](DecodeOptions* o) { o->patches.max_contradicted = 1e9f; }},
      {"contradicted_evidence", "contradicted patches fall whatever their evidence",
       [](DecodeOptions* o) { o->patches.min_evidence_contradicted = 1e9f; }},
      {"any_margin", "patches stand without a lead over the runner-up",
       [](DecodeOptions* o) { o->patches.min_margin = 1e-3f; }},
      {"any_evidence", "patches stand on any evidence",
       [](DecodeOptions* o) { o->patches.min_evidence = 1e-3f; }},
      {"no_ink_between", "lattice neighbours need no ink between them",
       [](DecodeOptions* o) { o->lattice.min_ink_contrast = 0; }},
      {"no_long_cells", "cells of the lattice are at most half longer than wide",
       [](DecodeOptions* o) { o->lattice.max_stretch = 1.5f; }},
      {"two_levels", "the smallest image is not searched", [](DecodeOptions* o) { o->levels = 2; }},
      {"one_level", "only the full image is searched", [](DecodeOptions* o) { o->levels = 1; }},
  };
  return variants;
}

struct Settings {
  std::vector<std::string> takes;
  bool cumulative = false;
  std::vector<std::string> only;
  std::string images, board, out, mosaic;
};

// "full" and the variants that are asked for, with what is left of the options.
std::vector<std::pair<Variant, DecodeOptions>> ChosenVariants(const Settings& settings) {
  std::vector<std::pair<Variant, DecodeOptions>> chosen = {{{"full", "", nullptr}, DecodeOptions()}};
  DecodeOptions options;
  for (const Variant& variant : Variants()) {
    const auto& only = settings.only;
    if (!only.empty() && std::find(only.begin(), only.end(), variant.name) == only.end()) continue;
    if (!settings.cumulative) options = DecodeOptions();
    variant.change(&options);
    chosen.push_back({variant, options});
  }
  return chosen;
}

// One line that is written over; a terminal is not asked for, as logs can be followed, too.
void ShowProgress(const std::string& what, size_t done, size_t all) {
  std::fprintf(stderr, "\r%-60s %zu of %zu views", what.c_str(), done, all);
  if (done == all) std::fputc('\n', stderr);
  std::fflush(stderr);
}

void PrintHead(const testing::TrueTake& take) {
  std::printf("%s, %zu views\n", take.name.c_str(), take.views.size());
  std::printf("%-24s %15s %7s %15s %15s %15s   %s\n", "", "recall %", "cells", "center px", "corner px",
              "user ms a view", "change");
  std::printf("%-24s %7s %7s %7s %7s %7s %7s %7s %7s %7s   %7s %7s %7s\n", "without", "all", "3-4 px",
              "wrong", "50 %", "95 %", "50 %", "95 %", "all", "less", "recall", "3-4 px", "wrong");
}

double MsAView(const DecodeScore& score) {
  return 1e3 * score.user_s / static_cast<double>(std::max<size_t>(score.views, 1));
}

void PrintLine(const std::string& name, const DecodeScore& score, const DecodeScore& full) {
  const std::vector<double> centers = score.ErrorsPx(NodeKind::kCenter),
                            corners = score.ErrorsPx(NodeKind::kCorner);
  const auto wrong = static_cast<long>(score.WrongCells()), wrong_full = static_cast<long>(full.WrongCells());
  std::printf("%-24s %7.2f %7.2f %7ld %7.4f %7.4f %7.4f %7.4f %7.1f %7.1f   %+7.2f %+7.2f %+7ld\n",
              name.c_str(), 100 * score.Recall(), 100 * score.Recall(3, 4), wrong, Quantile(centers, 0.5),
              Quantile(centers, 0.95), Quantile(corners, 0.5), Quantile(corners, 0.95), MsAView(score),
              MsAView(full) - MsAView(score), 100 * (score.Recall() - full.Recall()),
              100 * (score.Recall(3, 4) - full.Recall(3, 4)), wrong - wrong_full);
  std::fflush(stdout);
}

absl::Status ScoreTake(const std::string& folder, const Settings& settings) {
  const auto take = testing::ReadTrueTake(folder);
  if (!take.ok()) return take.status();
  const auto index = BoardIndex::Build(take->board);
  if (!index.ok()) return index.status();
  PrintHead(*take);
  std::optional<DecodeScore> full;
  for (const auto& [variant, options] : ChosenVariants(settings)) {
    const auto score = testing::DecodeAndScore(*take, *index, options, [&, &v = variant](size_t done) {
      ShowProgress(folder + ": " + v.name, done, take->views.size());
    });
    if (!score.ok()) return score.status();
    if (!full) full = *score;
    PrintLine(variant.name, *score, *full);
  }
  std::printf("\n");
  return absl::OkStatus();
}

std::vector<std::string> ImagesIn(const std::string& folder) {
  std::vector<std::string> images;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string ending = entry.path().extension().string();
    if (ending == ".png" || ending == ".jpg" || ending == ".jpeg" || ending == ".tif")
      images.push_back(entry.path().string());
  }
  std::sort(images.begin(), images.end());
  return images;
}

absl::Status WriteVariants(const Settings& settings) {
  const auto board = ReadBoard(settings.board);
  if (!board.ok()) return board.status();
  const auto index = BoardIndex::Build(*board);
  if (!index.ok()) return index.status();
  std::optional<PixelFormat> mosaic;
  if (!settings.mosaic.empty()) {
    const auto format = PixelFormatFromName(settings.mosaic);
    if (!format.ok()) return format.status();
    mosaic = *format;
  }
  const std::vector<std::string> images = ImagesIn(settings.images);
  if (images.empty())
    return absl::NotFoundError(settings.images +
                               ": no png, jpg or tif in this folder; give another by --images");
  std::error_code error;
  fs::create_directories(settings.out, error);
  for (const auto& [variant, options] : ChosenVariants(settings)) {
    std::vector<ImageObservations> found;
    double user_s = 0;
    for (const std::string& file : images) {
      const auto image = ReadImageFile(file, mosaic);
      if (!image.ok()) return image.status();
      const double start_s = testing::UserSeconds();
      auto result = DecodeView(*image, *index, options);
      if (!result.ok())
        return absl::Status(result.status().code(), file + ": " + std::string(result.status().message()));
      user_s += testing::UserSeconds() - start_s;
      found.push_back({fs::path(file).stem().string(), std::move(result->observations)});
      ShowProgress(variant.name, found.size(), images.size());
    }
    const std::string path = settings.out + "/" + variant.name + ".csv";
    if (absl::Status status = WriteObservations(path, found); !status.ok()) return status;
    std::printf("%-24s %7.1f user ms a view   %s\n", variant.name,
                1e3 * user_s / static_cast<double>(images.size()), path.c_str());
  }
  return absl::OkStatus();
}

std::string Teach() {
  std::string text =
      "What each step of the decoder is worth: decodes views with every step taken out alone, and prints "
      "what "
      "is lost.\n\nTakes are folders that `weft simulate` wrote, with their truth; the first and the middle "
      "frame of each are decoded:\n  weft simulate --preset quickstart --cameras 8 --frames 2 --out tube\n  "
      "ablation_decode tube\n\nColumns: recall of the cells that a view shows well, and of those of 3 to 4 "
      "px; "
      "cells that are not where they were found; errors of centres and corners (median, 95 %); processor "
      "time "
      "of a view, and how much less it is; and the change against the full decoder, recall in points.\n\n"
      "Photographs whose truth is known elsewhere: --images, --board and --out write one <step>.csv per line "
      "of the table, in the format of `weft decode`.\n\nSteps, the last of the decoder first:\n";
  for (const Variant& variant : Variants()) {
    text += "  ";
    text += variant.name;
    text.append(26 - std::string(variant.name).size(), ' ');
    text += variant.about;
    text += "\n";
  }
  return text +
         "No option takes out: fade presets and learning of inks, calibration of the appearance, growth "
         "itself, joint refinement of the centres, the test for mirrors.";
}

int Fail(const absl::Status& status) {
  std::fprintf(stderr, "ablation_decode: %s\n", std::string(status.message()).c_str());
  return 2;
}

int Run(int argc, char** argv) {
  Settings settings;
  CLI::App app(Teach(), "ablation_decode");
  std::vector<std::string> names;
  for (const Variant& variant : Variants()) names.emplace_back(variant.name);
  app.add_option("TAKE", settings.takes, "Folders with truth");
  app.add_flag("--cumulative", settings.cumulative,
               "Each line is without all steps of the lines before, too");
  app.add_option("--only", settings.only, "Some of the steps")->check(CLI::IsMember(names))->delimiter(',');
  auto* images =
      app.add_option("--images", settings.images, "Folder of photographs")->check(CLI::ExistingDirectory);
  auto* board =
      app.add_option("--board", settings.board, "Their board: board.json or board.png")->needs(images);
  auto* out = app.add_option("--out", settings.out, "Folder for the observations")->needs(images);
  images->needs(board)->needs(out);
  app.add_option("--mosaic", settings.mosaic, "Order of their Bayer mosaic, such as bayer_rg8")
      ->needs(images);
  CLI11_PARSE(app, argc, argv);
  if (settings.takes.empty() && settings.images.empty())
    return Fail(absl::InvalidArgumentError("no take and no --images given; --help tells how"));
  for (const std::string& take : settings.takes) {
    if (absl::Status status = ScoreTake(take, settings); !status.ok()) return Fail(status);
  }
  if (settings.images.empty()) return 0;
  const absl::Status status = WriteVariants(settings);
  return status.ok() ? 0 : Fail(status);
}

}  // namespace
}  // namespace weft

int main(int argc, char** argv) { return weft::Run(argc, argv); }
