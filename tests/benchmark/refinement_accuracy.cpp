// What `weft rig refine` leaves in right, knocked and late cameras. `accuracy_refinement --help` teaches its
// use. misfit_ratio and misfit_px of capture/calibration/rig_refinement.h follow from its figures.
#include <CLI/CLI.hpp>

#include <stdlib.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <numbers>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/median.h"
#include "base/random.h"
#include "services/formats/files/observations_file.h"
#include "services/formats/files/rig_file.h"
#include "services/studio/calibration/refine_rig.h"
#include "simulation/observation_model.h"
#include "simulation/take_presets.h"

namespace weft {
namespace {

constexpr int kFrames = 3;

struct Film {
  Rig rig;
  std::vector<std::vector<ImageObservations>> frames;  // [kFrames][cameras]
};

absl::StatusOr<Film> Simulate(const std::string& preset, int cameras, uint64_t seed) {
  absl::StatusOr<SyntheticTakeOptions> options = SyntheticPreset(preset, seed);
  if (!options.ok()) return options.status();
  options->performance.frames = kFrames;
  options->rig.cameras = cameras;
  absl::StatusOr<SyntheticTake> take = SyntheticTake::Make(*options);
  if (!take.ok()) return take.status();
  Film film{take->rig(), {}};
  const PrintLocator locator(
      PrintFromVertexNodes(take->garment().rest.faces, take->garment().node_of_vertex));
  for (int f = 0; f < kFrames; ++f) {
    absl::StatusOr<TakeFrame> frame = take->Next();
    if (!frame.ok()) return frame.status();
    std::vector<ImageObservations>& images = film.frames.emplace_back();
    for (const CameraModel& camera : film.rig.cameras) {
      const ViewTruth truth = FindViewTruth(frame->scene.mesh(), locator, frame->scene.rays(), camera);
      images.push_back({camera.id, ImitateDecoder(truth, seed * kFrames + f)});
    }
  }
  return film;
}

class ScratchFolder {
 public:
  ScratchFolder() : path_((std::filesystem::temp_directory_path() / "refinement XXXXXX").string()) {
    if (mkdtemp(path_.data()) == nullptr) path_.clear();
  }
  ~ScratchFolder() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  std::string operator/(const char* name) const { return absl::StrCat(path_, "/", name); }
  bool ok() const { return !path_.empty(); }

 private:
  std::string path_;
};

// Residuals of one camera after the refinement, and whether it was called a misfit.
struct Left {
  double px = 0, ratio = 0;
  bool is_misfit = false;
};

// [cameras]; camera `late` (or none: -1) sends each frame one late.
absl::StatusOr<std::vector<Left>> Refine(const Film& film, const Rig& rig, int late) {
  const ScratchFolder folder;
  if (!folder.ok()) return absl::UnavailableError("no temporary folder could be made");
  const std::string result = folder / "result", rig_file = folder / "rig.json";
  if (absl::Status status = WriteRig(rig_file, rig); !status.ok()) return status;
  for (int f = 0; f + 1 < kFrames; ++f) {
    std::vector<ImageObservations> images = film.frames[f];
    if (late >= 0) images[late].observations = film.frames[f + 1][late].observations;
    const std::string frame = absl::StrCat(result, "/", f);
    std::filesystem::create_directories(frame);
    if (absl::Status status = WriteObservations(frame + "/observations.csv", images); !status.ok())
      return status;
  }
  const auto refined = RefineRigFromResult({.result = result, .rig = rig_file, .out = folder / "out.json"});
  if (!refined.ok()) return refined.status();
  std::vector<double> sigmas;
  for (const CameraCorrection& correction : refined->refined.corrections)
    if (!correction.held) sigmas.push_back(correction.after_median_sigmas);
  const double usual = Median(std::move(sigmas));
  std::vector<Left> left;
  for (const CameraCorrection& correction : refined->refined.corrections)
    left.push_back({correction.after_median_px, correction.after_median_sigmas / usual, correction.misfit});
  return left;
}

Rig Knocked(Rig rig, int camera, double angle_deg) {
  CameraModel& knocked = rig.cameras[camera];
  const Eigen::Vector3d center = knocked.CenterWorld();
  knocked.rotation =
      Eigen::AngleAxisd(angle_deg * std::numbers::pi / 180, Eigen::Vector3d(1, -1, 0.3).normalized()) *
      knocked.rotation;
  knocked.translation_mm = -knocked.rotation * center;
  return rig;
}

absl::Status Run(int takes) {
  constexpr const char* kPresets[] = {"quickstart", "pleats", "gathers", "curls", "tiny"};
  constexpr int kCameras[] = {16, 8, 12, 24};
  double right_px = 0, right_ratio = 0;
  int right = 0, blamed = 0, late_found = 0, late = 0;
  std::vector<double> late_px, late_ratios;
  for (int i = 0; i < takes; ++i) {
    const std::string preset = kPresets[i % std::size(kPresets)];
    const int cameras = kCameras[i % std::size(kCameras)];
    const absl::StatusOr<Film> film = Simulate(preset, cameras, 300 + i);
    if (!film.ok()) return film.status();
    Random random(i);
    const int chosen = static_cast<int>(random.Below(cameras));
    for (const Rig& rig : {film->rig, Knocked(film->rig, chosen, 0.1)}) {
      const auto of_right = Refine(*film, rig, -1);
      if (!of_right.ok()) return of_right.status();
      for (const Left& camera : *of_right) {
        ++right, blamed += camera.is_misfit;
        right_ratio = std::max(right_ratio, camera.ratio);
        right_px = std::max(right_px, camera.px);
      }
    }
    std::printf("%d %s, %d cameras: right ones so far up to %.2f px and %.2f times the others'\n", i,
                preset.c_str(), cameras, right_px, right_ratio);
    const auto of_late = Refine(*film, film->rig, chosen);
    if (!of_late.ok()) {
      std::printf("%d %s, %d cameras, one late: %s\n", i, preset.c_str(), cameras,
                  std::string(of_late.status().message()).c_str());
      continue;
    }
    for (int c = 0; c < cameras; ++c)
      if (c != chosen) ++right, blamed += (*of_late)[c].is_misfit;
    const Left& camera = (*of_late)[chosen];
    ++late, late_found += camera.is_misfit;
    late_px.push_back(camera.px), late_ratios.push_back(camera.ratio);
    std::printf("%d %s, %d cameras, one late: %.2f px are left, %.1f times the others'%s\n", i,
                preset.c_str(), cameras, camera.px, camera.ratio, camera.is_misfit ? "" : ", not found");
    std::fflush(stdout);
  }
  std::printf(
      "right and knocked cameras: %d of %d called misfits, up to %.2f px and %.2f times the others'\n"
      "late cameras: %d of %d found, least %.2f px and %.1f times the others'\n",
      blamed, right, right_px, right_ratio, late_found, late,
      *std::min_element(late_px.begin(), late_px.end()),
      *std::min_element(late_ratios.begin(), late_ratios.end()));
  return absl::OkStatus();
}

}  // namespace
}  // namespace weft

int main(int argc, char** argv) {
  CLI::App app(
      "Refines rigs by simulated takes, of many presets, seeds and numbers of cameras, by the decoder's "
      "model "
      "instead of pictures. Each once as it is, once with a camera knocked by 0.1 degrees, and once with a "
      "camera that is a frame late. Prints what is left in the residuals of right, knocked and late cameras.",
      "accuracy_refinement");
  int takes = 10;
  app.add_option("--takes", takes, "Takes")->capture_default_str()->check(CLI::Range(1, 1000));
  CLI11_PARSE(app, argc, argv);
  const absl::Status status = weft::Run(takes);
  if (status.ok()) return 0;
  std::fprintf(stderr, "accuracy_refinement: %s\n", std::string(status.message()).c_str());
  return 2;
}
