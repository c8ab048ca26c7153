// Films cloth in layers (layered_sheets.h) as a take of one frame with truth. `film_layers --help` teaches
// its use.
#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <string>

#include "absl/strings/str_cat.h"
#include "capture/image/image_file.h"
#include "services/formats/files/board_file.h"
#include "services/formats/synthetic/truth_file.h"
#include "tests/benchmark/layered_sheets.h"

namespace weft::testing {
namespace {

absl::Status Write(uint64_t seed, int views, const std::string& out) {
  const auto scene = MakeLayers(seed);
  if (!scene.ok()) return scene.status();
  if (absl::Status status = WriteBoard(out, scene->board, absl::StrCat("film_layers --seed ", seed));
      !status.ok()) {
    return status;
  }
  std::error_code error;
  std::filesystem::create_directories(out + "/0000", error);
  if (error) return absl::UnavailableError(absl::StrCat(out, "/0000: ", error.message()));
  FrameTruth truth{scene->scene.mesh(), {}};
  for (int view = 0; view < views; ++view) {
    auto filmed = FilmLayers(*scene, seed, view);
    if (!filmed.ok()) return filmed.status();
    const std::string image = absl::StrCat(out, "/0000/", filmed->camera.id, ".png");
    if (absl::Status status = WriteImageFile(image, filmed->image); !status.ok()) return status;
    truth.views.push_back(std::move(filmed->truth));
  }
  return WriteFrameTruth(out + "/truth/0000", truth);
}

}  // namespace
}  // namespace weft::testing

int main(int argc, char** argv) {
  CLI::App app(
      "Films cloth in layers: seams between panels from anywhere on the board, sheets over sheets, "
      "silhouettes, "
      "fingers, and pictures that were enlarged. accuracy_decode, ablation_decode and refit_decode read what "
      "it writes.",
      "film_layers");
  uint64_t seed = 1;
  int views = 6;
  std::string out;
  app.add_option("--seed", seed, "Of scene, cameras and noise")->capture_default_str();
  app.add_option("--views", views, "Pictures, each by a camera of its own")
      ->check(CLI::Range(1, 10))
      ->capture_default_str();
  app.add_option("--out", out, "Folder to write")->required();
  CLI11_PARSE(app, argc, argv);
  const absl::Status status = weft::testing::Write(seed, views, out);
  if (status.ok()) return 0;
  std::fprintf(stderr, "film_layers: %s\n", std::string(status.message()).c_str());
  return 2;
}
