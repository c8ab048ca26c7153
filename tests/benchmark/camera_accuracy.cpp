// Which wrong rigs the verdict names, and whether it blames right ones. `accuracy_cameras --help` teaches its
// use. The limits of services/formats/verdict/camera_checks.h and limits.h (register.cameras_agree, .lens,
// .scale) follow from its figures.
#include <CLI/CLI.hpp>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <iterator>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "alignment/cloth_in_view.h"
#include "base/median.h"
#include "base/random.h"
#include "capture/rig/exchange_cameras.h"
#include "services/formats/files/agreement_proto.h"
#include "services/formats/files/observations_file.h"
#include "services/formats/files/rig_file.h"
#include "services/formats/verdict/verdict.h"
#include "services/results/report/camera_facts.h"
#include "simulation/observation_model.h"
#include "simulation/take_presets.h"
#include "tests/benchmark/disturbed_views.h"
#include "triangulation/clean.h"
#include "triangulation/cloud_scale.h"

namespace weft {
namespace {

using Views = std::vector<ViewObservations>;

struct Film {
  Rig rig;
  std::vector<Views> frames;
  double cell_mm = 0;  // 0: not known
  Template garment;    // of simulated frames, with the true mesh of each
  std::vector<RegisteredMesh> meshes;
};

struct Trial {
  v1::Verdict verdict;
  CameraFacts facts;
};

void DescribeInView(const Film& film, size_t frame, v1::FrameReport& report) {
  if (frame >= film.meshes.size()) return;
  const Views& views = film.frames[frame];
  const std::vector<ClothInView> in_view =
      CountClothInView(film.rig, views, film.garment, film.meshes[frame]);
  for (size_t v = 0; v < in_view.size(); ++v) {
    v1::ViewReport& view = *report.mutable_views(views[v].camera);
    view.set_vertices_in_view(in_view[v].vertices);
    view.set_vertices_seen(in_view[v].seen);
  }
}

Trial Judge(const Film& film) {
  std::vector<v1::FrameReport> reports;
  for (size_t f = 0; f < film.frames.size(); ++f) {
    const Views& views = film.frames[f];
    const TriangulationOptions options;
    absl::StatusOr<Cloud> cloud = Triangulate(film.rig, views, options);
    if (!cloud.ok()) continue;
    const Cloud clean = CleanCloud(*std::move(cloud), {});
    const auto agreements = MeasureCameraAgreement(film.rig, views, clean, options);
    v1::FrameReport& report = reports.emplace_back();
    for (size_t c = 0; c < film.rig.cameras.size(); ++c) {
      v1::ViewReport& view = *report.add_views();
      view.set_camera(film.rig.cameras[c].id);
      DescribeAgreement((*agreements)[c], film.rig, view);
    }
    DescribeInView(film, f, report);
    const auto scale = MeasureCloudScale(clean, [&](const BoardNode&, const BoardNode&) {
      return film.cell_mm > 0 ? std::optional<double>(film.cell_mm) : std::nullopt;
    });
    if (scale) report.mutable_cloud()->set_print_scale(*scale);
  }
  Trial trial;
  trial.facts = FactsOf(reports);
  AddFinding(trial.verdict, v1::GRADE_GOOD, "good", "");
  const bool is_named = FaultOf(trial.facts.cameras).is_named;
  if (is_named) AddAgreementCheck(trial.facts.cameras, trial.verdict);
  AddScaleCheck(trial.facts, trial.verdict);
  if (!is_named) AddAgreementCheck(trial.facts.cameras, trial.verdict);
  AddOffsetCheck(trial.facts.cameras, trial.verdict);
  AddSightCheck(trial.facts.cameras, trial.verdict);
  return trial;
}

absl::StatusOr<Film> Simulate(const std::string& preset, uint64_t seed,
                              const std::function<void(SyntheticTakeOptions&)>& change) {
  absl::StatusOr<SyntheticTakeOptions> options = SyntheticPreset(preset, seed);
  if (!options.ok()) return options.status();
  options->performance.frames = 1;
  change(*options);
  absl::StatusOr<SyntheticTake> take = SyntheticTake::Make(*options);
  if (!take.ok()) return take.status();
  absl::StatusOr<TakeFrame> frame = take->Next();
  if (!frame.ok()) return frame.status();
  Film film{take->rig(), {{}}, take->board().cell_mm, take->garment(), {}};
  RegisteredMesh mesh;
  mesh.vertices_mm = frame->scene.mesh().vertices_mm;
  mesh.state.assign(mesh.vertices_mm.size(), VertexState::kObserved);
  film.meshes.push_back(std::move(mesh));
  const PrintLocator locator(
      PrintFromVertexNodes(take->garment().rest.faces, take->garment().node_of_vertex));
  for (size_t c = 0; c < film.rig.cameras.size(); ++c) {
    const ViewTruth truth =
        FindViewTruth(frame->scene.mesh(), locator, frame->scene.rays(), film.rig.cameras[c]);
    film.frames[0].push_back({static_cast<int>(c), ImitateDecoder(truth, seed)});
  }
  return film;
}

class Table {
 public:
  void Add(const std::string& kind, const std::string& name, const Trial& trial, bool is_right,
           bool prints_all) {
    auto& [right, all] = counts_[kind];
    right += is_right, ++all;
    if (!is_right || prints_all)
      std::printf("%s %s %s: %s: %s\n", is_right ? "ok  " : "FAIL", kind.c_str(), name.c_str(),
                  GradeWord(trial.verdict.grade()).c_str(), trial.verdict.reason().c_str());
    if (kind != "right") return;
    AddSight(trial.facts.cameras);
    AddDistances(name, trial.facts.cameras);
    for (const CameraStanding& camera : trial.facts.cameras)
      if (camera.compared >= kLeastCompared)
        least_share_ = std::min(least_share_,
                                static_cast<double>(camera.agreeing) / static_cast<double>(camera.compared));
    for (const v1::VerdictCheck& check : trial.verdict.checks()) {
      double& worst = worst_[check.id()];
      worst = std::max(worst, std::atof(check.value().c_str()));
    }
  }
  void Print() const {
    for (const auto& [kind, count] : counts_)
      std::printf("%-20s %d of %d\n", kind.c_str(), count.first, count.second);
    std::printf(
        "right takes: least share that agrees %.3f, least that a camera sees of what most see %.3f, "
        "distance of a camera up to %.2f px and %.1f medians, lens up to %.3f %%, scale up to %.3f %%, "
        "offset "
        "up to %.3f px\n",
        least_share_, least_sight_, farthest_px_, farthest_ratio_,
        worst_.contains("register.lens") ? worst_.at("register.lens") : 0,
        worst_.contains("register.scale") ? worst_.at("register.scale") : 0,
        worst_.contains("register.offset") ? worst_.at("register.offset") : 0);
  }

 private:
  void AddSight(const std::vector<CameraStanding>& cameras) {
    std::vector<double> shares;
    for (const CameraStanding& camera : cameras)
      if (camera.in_view >= kLeastInView)
        shares.push_back(static_cast<double>(camera.seen) / static_cast<double>(camera.in_view));
    if (shares.empty()) return;
    const double least = *std::min_element(shares.begin(), shares.end());
    least_sight_ = std::min(least_sight_, least / Median(std::move(shares)));
  }

  // A camera that was knocked on purpose is no measure.
  void AddDistances(const std::string& name, const std::vector<CameraStanding>& cameras) {
    std::vector<double> medians_px;
    for (const CameraStanding& camera : cameras)
      if (camera.compared >= kLeastCompared) medians_px.push_back(camera.median_px);
    if (medians_px.empty() || absl::StrContains(name, "knocked")) return;
    const double most = *std::max_element(medians_px.begin(), medians_px.end());
    farthest_px_ = std::max(farthest_px_, most);
    farthest_ratio_ = std::max(farthest_ratio_, most / Median(std::move(medians_px)));
  }

  std::map<std::string, std::pair<int, int>> counts_;
  std::map<std::string, double> worst_;
  double least_share_ = 1, least_sight_ = 1, farthest_px_ = 0, farthest_ratio_ = 0;
};

std::vector<std::string> Draw(const Rig& rig, size_t count, Random& random) {
  std::vector<std::string> ids;
  while (ids.size() < count) {
    const std::string& id = rig.cameras[random.Below(rig.cameras.size())].id;
    if (std::find(ids.begin(), ids.end(), id) == ids.end()) ids.push_back(id);
  }
  return ids;
}

// As cables, files and hands exchange them; of images that were cropped the size stays.
void TryExchanges(const Film& film, int count, CameraPart part, bool prints_all, Table* table) {
  Random random(17);
  for (const size_t size : {size_t{2}, size_t{3}}) {
    for (int i = 0; i < count; ++i) {
      std::vector<std::string> ids = Draw(film.rig, size, random);
      if (size == 2) std::sort(ids.begin(), ids.end());
      Film wrong = film;
      const auto places = ExchangedPlaces(film.rig, ids);
      if (!places.ok()) continue;
      wrong.rig = WithPlaces(film.rig, *places, part);
      const Trial trial = Judge(wrong);
      const std::string& reason = trial.verdict.reason();
      bool is_right = absl::StrContains(reason, "are exchanged") && !absl::StrContains(reason, "; ");
      for (const std::string& id : ids) is_right = is_right && absl::StrContains(reason, id);
      table->Add(absl::StrCat(size == 2 ? "pair, " : "ring, ", std::string(CameraPartName(part))),
                 absl::StrCat(i), trial, is_right, prints_all);
    }
  }
}

void TryFaults(const Film& film, bool prints_all, Table* table) {
  Random random(18);
  for (int i = 0; i < 5; ++i) {
    const std::string id = Draw(film.rig, 1, random)[0];
    const int c = film.rig.IndexOf(id);
    const auto attempt = [&](const std::string& kind, const std::string& words, const auto& change) {
      Film wrong = film;
      change(wrong.rig.cameras[c]);
      const Trial trial = Judge(wrong);
      table->Add(
          kind, id, trial,
          absl::StrContains(trial.verdict.reason(), words) && absl::StrContains(trial.verdict.reason(), id),
          prints_all);
    };
    attempt("elsewhere", "agrees with no other", [](CameraModel& camera) {
      camera.rotation = Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitY()).toRotationMatrix() * camera.rotation;
    });
    attempt("upside down", "upside down", [](CameraModel& camera) {
      const Eigen::Matrix3d turn = Eigen::Vector3d(-1, -1, 1).asDiagonal();
      camera.rotation = turn * camera.rotation, camera.translation_mm = turn * camera.translation_mm;
      camera.cx_px = camera.width_px - 1 - camera.cx_px, camera.cy_px = camera.height_px - 1 - camera.cy_px;
      camera.distortion[2] *= -1, camera.distortion[3] *= -1;
    });
    if (!film.meshes.empty()) {
      Film wrong = film;
      std::erase_if(wrong.frames[0][c].observations,
                    [&](const Observation&) { return Uniform(random) > 0.03; });
      const Trial blind = Judge(wrong);
      table->Add("blind", id, blind,
                 absl::StrContains(blind.verdict.reason(), absl::StrCat("camera ", id, " sees little")),
                 prints_all);
    }
    for (const double factor : {0.95, 1.02})
      attempt("zoom of one", "",
              [factor](CameraModel& camera) { camera.fx_px *= factor, camera.fy_px *= factor; });
  }
  for (const double factor : {0.9, 0.95, 1.05, 1.1}) {
    Film wrong = film;
    for (CameraModel& camera : wrong.rig.cameras) camera.fx_px *= factor, camera.fy_px *= factor;
    const Trial trial = Judge(wrong);
    table->Add("focal lengths", absl::StrCat(factor), trial,
               absl::StrContains(trial.verdict.reason(), "the lenses of the rig"), prints_all);
  }
  for (const double factor : {0.001, 1 / 25.4, 0.1, 0.95, 1.05, 10.0, 25.4, 1000.0}) {
    Film wrong = film;
    for (CameraModel& camera : wrong.rig.cameras) camera.translation_mm *= factor;
    const Trial trial = Judge(wrong);
    table->Add("scale", absl::StrCat(factor), trial,
               absl::StrContains(trial.verdict.reason(), "print") || trial.verdict.grade() == v1::GRADE_BAD,
               prints_all);
  }
}

// Takes with nothing wrong but what has messages of its own.
absl::Status TryRight(int from, int takes, bool prints_all, Table* table) {
  constexpr Disturbance kDisturbances[] = {
      {},
      {.noise_px = 0.5},
      {.wrong_share = 0.01},
      {.kept_share = 0.3},
      {.half_hidden = 3},
      {.half_seeing = 2},
      {.knock_deg = 0.03},
      {.noise_px = 0.3, .wrong_share = 0.02, .kept_share = 0.6, .half_hidden = 2},
      {.knock_deg = 0.2},
      {.kept_share = 0.1}};
  constexpr int kCameras[] = {16, 3, 4, 5, 6, 8, 12, 24, 16, 7, 10};
  constexpr const char* kPresets[] = {"quickstart", "tiny",  "quickstart", "pleats",
                                      "gathers",    "curls", "tiny"};
  for (int i = from; i < takes; ++i) {
    const std::string preset = kPresets[i % std::size(kPresets)];
    const int cameras = kCameras[i % std::size(kCameras)];
    absl::StatusOr<Film> film =
        Simulate(preset, 100 + i, [&](SyntheticTakeOptions& options) { options.rig.cameras = cameras; });
    if (!film.ok()) return film.status();
    const size_t disturbance = i % std::size(kDisturbances);
    Disturb(kDisturbances[disturbance], i, film->frames, film->rig);
    const Trial trial = Judge(*film);
    table->Add("right",
               absl::StrCat(i, " ", preset, " ", cameras, " cameras, disturbance ", disturbance,
                            kDisturbances[disturbance].knock_deg > 0 ? ", one knocked" : ""),
               trial, trial.verdict.grade() == v1::GRADE_GOOD, prints_all);
  }
  return absl::OkStatus();
}

absl::StatusOr<Film> ReadFilm(const std::string& observations, const std::string& rig_path, double cell_mm) {
  const absl::StatusOr<Rig> rig = ReadRig(rig_path);
  if (!rig.ok()) return rig.status();
  const auto images = ReadObservations(observations);
  if (!images.ok()) return images.status();
  Film film{*rig, {{}}, cell_mm};
  for (const ImageObservations& image : *images)
    if (const int camera = rig->IndexOf(image.image); camera >= 0)
      film.frames[0].push_back({camera, image.observations});
  return film;
}

struct Options {
  std::string observations, rig;
  double cell_mm = 0;
  int exchanges = 20, from = 0, takes = 60;
  bool all = false;
};

absl::Status Run(const Options& options) {
  Table table;
  absl::StatusOr<Film> film = options.observations.empty()
                                  ? Simulate("quickstart", 1, [](SyntheticTakeOptions&) {})
                                  : ReadFilm(options.observations, options.rig, options.cell_mm);
  if (!film.ok()) return film.status();
  const Trial right = Judge(*film);
  table.Add("right", "as it is", right, right.verdict.grade() == v1::GRADE_GOOD, options.all);
  for (const CameraPart part : {CameraPart::kPlaceAndLens, CameraPart::kPlace})
    TryExchanges(*film, options.exchanges, part, options.all, &table);
  if (options.exchanges > 0) TryFaults(*film, options.all, &table);
  if (options.observations.empty())
    if (absl::Status status = TryRight(options.from, options.takes, options.all, &table); !status.ok())
      return status;
  table.Print();
  return absl::OkStatus();
}

}  // namespace
}  // namespace weft

int main(int argc, char** argv) {
  CLI::App app(
      "Judges rigs with a fault (cameras exchanged, elsewhere, upside down, wrong lenses, wrong scale) on a "
      "frame "
      "of the preset quickstart, and right rigs on frames of many presets, seeds, numbers of cameras and "
      "disturbances, by the decoder's model instead of pictures. With --observations the faults alone, on a "
      "frame that was decoded.",
      "accuracy_cameras");
  weft::Options options;
  auto* file = app.add_option("--observations", options.observations, "observations.csv of a frame");
  app.add_option("--rig", options.rig, "Its rig.json")->needs(file);
  app.add_option("--cell-mm", options.cell_mm, "Pitch of its print")->needs(file);
  app.add_option("--exchanges", options.exchanges,
                 "Pairs, and rings of three; 0 leaves out other faults, too")
      ->capture_default_str();
  app.add_option("--from", options.from, "The first of the right takes")->capture_default_str();
  app.add_option("--takes", options.takes, "Right takes")->capture_default_str();
  app.add_flag("--all", options.all, "Print every trial, not only what went wrong");
  CLI11_PARSE(app, argc, argv);
  setvbuf(stdout, nullptr, _IOLBF, 0);  // it takes half an hour
  const absl::Status status = weft::Run(options);
  if (status.ok()) return 0;
  std::fprintf(stderr, "accuracy_cameras: %s\n", std::string(status.message()).c_str());
  return 2;
}
