// How far driven meshes are off, against the true cloth, by the number of cameras and by how many seconds of
// motion were learnt: `accuracy_drive --help`.
#include <tbb/parallel_for.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "animation/sparse_view/sparse_view_driver.h"
#include "animation/sparse_view/sparse_view_training.h"
#include "base/median.h"
#include "base/stopwatch.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/template_file.h"
#include "services/formats/synthetic/frames_file.h"
#include "services/work/animation/avatar_file.h"
#include "services/work/animation/net_sample.h"
#include "services/work/animation/truth_views.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

struct Options {
  std::string folder;
  std::vector<int> cameras = {2, 3, 4};
  std::string without;  // a motion that is not learnt
  std::vector<std::string> tests = {"known", "unseen"};
  int every = 1;  // of the training's frames
  // The first share of each take that is learnt from, an avatar for each.
  std::vector<double> shares = {1};
  int most = 100;      // frames of a test take
  std::string avatar;  // folder of one that is driven instead of learning
  std::string net;     // folder of a net
  int level = 1, gutter = 3;
  int dark_from = -1;  // the first camera sees nothing for 15 frames from here
  SparseViewTraining training;
  SparseViewOptions driving;
};

struct Take {
  std::string name;
  FramesReader reader;
};

std::vector<Take> TakesOf(const std::string& folder, const std::string& split) {
  std::vector<std::string> names;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (const std::string name = entry.path().filename().string();
        name == split || name.starts_with(split + "-"))
      names.push_back(entry.path().string());
  std::sort(names.begin(), names.end());
  std::vector<Take> out;
  for (const std::string& name : names) {
    std::string path = name + "/truth/frames.bin";
    if (!fs::exists(path)) path += ".part";
    absl::StatusOr<FramesReader> reader = FramesReader::Open(path, true);
    if (reader.ok() && reader->frames() > 3)
      out.push_back({fs::path(name).filename().string(), *std::move(reader)});
  }
  return out;
}

// "train-twist-1": twist.
std::string MotionOf(const std::string& take) {
  const size_t first = take.find('-'), last = take.rfind('-');
  return first == last ? take : take.substr(first + 1, last - first - 1);
}

// Also says how many seconds it learnt from.
absl::StatusOr<SparseViewAvatar> Train(const Options& options, const Template& garment, double share,
                                       double* seconds) {
  if (!options.avatar.empty()) {
    absl::StatusOr<AvatarFile> file = ReadAvatar(options.avatar);
    if (!file.ok()) return file.status();
    return std::move(file->avatar);
  }
  std::vector<Take> learnt = TakesOf(options.folder, "train"), held = TakesOf(options.folder, "val");
  for (Take& take : TakesOf(options.folder, "validate")) held.push_back(std::move(take));
  std::erase_if(learnt, [&](const Take& take) { return MotionOf(take.name) == options.without; });
  TrainingFrames frames;
  std::vector<Take*> takes;
  *seconds = 0;
  for (Take& t : learnt) {
    const int first = static_cast<int>(std::ceil(share * t.reader.frames()));
    *seconds += first / t.reader.head().fps;
    frames.takes.push_back(
        {t.name, (first + options.every - 1) / options.every, t.reader.head().fps, false, MotionOf(t.name)});
    takes.push_back(&t);
  }
  for (Take& t : held) {
    frames.takes.push_back({t.name, t.reader.frames(), t.reader.head().fps, true, MotionOf(t.name)});
    takes.push_back(&t);
  }
  frames.read = [&](int take, int frame) -> absl::StatusOr<std::vector<Eigen::Vector3d>> {
    const int step = frames.takes[take].held_out ? 1 : options.every;
    absl::StatusOr<ClothFrame> read = takes[take]->reader.Read(frame * step);
    if (!read.ok()) return read.status();
    return std::move(read->vertices_mm);
  };
  return TrainSparseView(garment, frames, options.training);
}

struct Tally {
  std::vector<double> all, carrier, plain, none, one, more, jitter, ms;
  int within1 = 0, within2 = 0, frames = 0, lost = 0;

  double Mean() const {
    double sum = 0;
    for (const double e : all) sum += e;
    return all.empty() ? 0 : sum / static_cast<double>(all.size());
  }
  void Print(const std::string& name) const {
    const auto mean = [](const std::vector<double>& x) {
      double sum = 0;
      for (const double v : x) sum += v;
      return x.empty() ? 0 : sum / static_cast<double>(x.size());
    };
    std::printf(
        "%-24s %4d %5.2f %5.2f %5.2f %6.2f %5.2f | %5.2f %5.2f %5.2f | %4.0f %4.0f | %5.2f %5.1f %d\n",
        name.c_str(), frames, mean(carrier), mean(plain), mean(all), Median(all), Quantile(all, 0.95),
        mean(none), mean(one), mean(more), 100.0 * within1 / std::max<size_t>(1, all.size()),
        100.0 * within2 / std::max<size_t>(1, all.size()), mean(jitter), Median(ms), lost);
    std::fflush(stdout);
  }
  void Add(const Tally& o) {
    for (auto [to, from] : {std::pair(&all, &o.all),
                            {&carrier, &o.carrier},
                            {&plain, &o.plain},
                            {&none, &o.none},
                            {&one, &o.one},
                            {&more, &o.more},
                            {&jitter, &o.jitter},
                            {&ms, &o.ms}})
      to->insert(to->end(), from->begin(), from->end());
    within1 += o.within1, within2 += o.within2, frames += o.frames, lost += o.lost;
  }
};

Tally DriveTake(const Options& options, const Template& garment, const SparseViewAvatar& avatar, Take* take,
                int cameras) {
  const TruthViews cloth(garment, BodyShape());
  const Rig rig = *DrivingRig(cameras, take->reader.Read(0)->vertices_mm, 1);
  SparseViewDriver driver = *SparseViewDriver::Create(garment, avatar, options.driving);
  Tally out;
  std::vector<std::vector<Eigen::Vector3d>> offs;
  const int frames = std::min(options.most, take->reader.frames());
  for (int f = 0; f < frames; ++f) {
    const auto truth = take->reader.Read(f);
    const std::vector<ViewObservations> seen = *cloth.Observe(*truth, rig, static_cast<uint64_t>(f));
    std::vector<DrivingView> views;
    for (size_t c = 0; c < rig.cameras.size(); ++c) {
      const bool dark =
          c == 0 && options.dark_from >= 0 && f >= options.dark_from && f < options.dark_from + 15;
      views.push_back({&rig.cameras[c], dark ? std::span<const Observation>() : seen[c].observations});
    }
    const Stopwatch watch;
    const auto driven = driver.Drive(truth->time_ns + 1, views);
    if (!driven.ok()) {
      std::printf("%s\n", std::string(driven.status().message()).c_str());
      break;
    }
    out.ms.push_back(1000 * watch.Seconds());
    ++out.frames;
    out.lost += driven->lost ? 1 : 0;
    double sum = 0, worst = 0;
    offs.emplace_back();
    for (size_t v = 0; v < truth->vertices_mm.size(); ++v) {
      const Eigen::Vector3d off = driven->mesh.vertices_mm[v] - truth->vertices_mm[v];
      const double e = off.norm();
      offs.back().push_back(off);
      out.all.push_back(e);
      out.carrier.push_back((driven->carrier_mm[v] - truth->vertices_mm[v]).norm());
      if (!driven->uncorrected_mm.empty())
        out.plain.push_back((driven->uncorrected_mm[v] - truth->vertices_mm[v]).norm());
      const int rays = driven->mesh.views[v];
      (rays == 0 ? out.none : rays == 1 ? out.one : out.more).push_back(e);
      out.within1 += e < driven->mesh.sigma_mm[v] ? 1 : 0,
          out.within2 += e < 2 * driven->mesh.sigma_mm[v] ? 1 : 0;
      sum += e, worst = std::max(worst, e);
    }
    if (offs.size() > 3) offs.erase(offs.begin());
    if (offs.size() == 3)
      for (size_t v = 0; v < offs[0].size(); ++v)
        out.jitter.push_back((offs[0][v] - 2 * offs[1][v] + offs[2][v]).norm());
    if (options.dark_from >= 0)
      std::printf("  %s frame %d: mean %.2f worst %.1f%s\n", take->name.c_str(), f,
                  sum / static_cast<double>(truth->vertices_mm.size()), worst, driven->lost ? " LOST" : "");
  }
  return out;
}

// What weft-train wrote.
absl::Status ReadNet(const Options& options, SparseViewAvatar* avatar) {
  const absl::StatusOr<std::string> onnx = ReadWholeFile(options.net + "/" + kAvatarNetFile);
  if (!onnx.ok()) return onnx.status();
  avatar->net.onnx = *onnx;
  avatar->net.atlas.level = options.level, avatar->net.atlas.gutter = options.gutter;
  const std::string path = options.net + "/" + kAvatarSampleFile;
  const absl::StatusOr<std::string> sample = ReadWholeFile(path);
  return sample.ok() ? DecodeNetSample(*sample, path, &avatar->net) : sample.status();
}

// A row of the curve over seconds of training.
struct CurveRow {
  double seconds = 0;
  std::string test;
  double mean_mm = 0, median_mm = 0;
};

void Learn(const Options& options, const Template& garment, double share, std::vector<CurveRow>* curve);

void Run(const Options& options) {
  std::vector<Take> any = TakesOf(options.folder, "train");
  const auto garment = ReadTemplate((fs::path(options.folder) / any.front().name / "template").string());
  if (!garment.ok()) {
    std::printf("%s\n", std::string(garment.status().message()).c_str());
    return;
  }
  std::vector<CurveRow> curve;
  for (const double share : options.shares) Learn(options, *garment, share, &curve);
  if (options.shares.size() < 2) return;
  std::printf("\nmm by seconds of motion that were learnt\n");
  for (const CurveRow& row : curve)
    std::printf("%7.1f s  %-24s  mean %6.3f  median %6.3f\n", row.seconds, row.test.c_str(), row.mean_mm,
                row.median_mm);
}

void Learn(const Options& options, const Template& garment, double share, std::vector<CurveRow>* curve) {
  const Stopwatch watch;
  double seconds = 0;
  auto avatar = Train(options, garment, share, &seconds);
  if (!avatar.ok()) {
    std::printf("%s\n", std::string(avatar.status().message()).c_str());
    return;
  }
  if (const absl::Status read = options.net.empty() ? absl::OkStatus() : ReadNet(options, &*avatar);
      !read.ok()) {
    std::printf("%s\n", std::string(read.message()).c_str());
    return;
  }
  std::printf(
      "%.1f s of motion, %d frames learnt, %d held out, %d components, left %.2f mm per axis; %.0f s\n",
      seconds, avatar->training_frames, avatar->held_out_frames, avatar->space.components(),
      avatar->space.left_mm, watch.Seconds());
  for (const SigmaCheck& check : {avatar->held_out_check, avatar->left_out_check})
    std::printf("sigma fitted to %d frames: %.1f %% %.1f %%, loss %.3f\n", check.frames,
                100 * check.within_one, 100 * check.within_two, check.loss);
  for (const auto& of_cameras : avatar->sigma.of)
    std::printf("sigma %.2f %.2f %.2f %.2f\n", of_cameras[0], of_cameras[1], of_cameras[2], of_cameras[3]);
  std::printf(
      "mm: carrier mean, without net, result mean, median, 95 %% | mean with 0, 1, more rays | within 1, 2 "
      "sigma %% | 2nd "
      "difference, ms\n");
  for (const int cameras : options.cameras)
    for (const std::string& test : options.tests) {
      std::vector<Take> takes = TakesOf(options.folder, test);
      std::vector<Tally> tallies(takes.size());
      tbb::parallel_for(size_t{0}, takes.size(), [&](size_t t) {
        tallies[t] = DriveTake(options, garment, *avatar, &takes[t], cameras);
      });
      Tally all;
      for (size_t t = 0; t < takes.size(); ++t) {
        tallies[t].Print("  " + takes[t].name + " x" + std::to_string(cameras));
        all.Add(tallies[t]);
      }
      all.Print(test + " x" + std::to_string(cameras));
      curve->push_back({seconds, test + " x" + std::to_string(cameras), all.Mean(), Median(all.all)});
    }
}

}  // namespace
}  // namespace weft

int main(int argc, char** argv) {
  weft::Options o;
  CLI::App app(
      "Learns an avatar of the takes train-* of a folder, with val-* and validate-* held out, and drives "
      "those "
      "of --tests");
  app.add_option("folder", o.folder)->required();
  app.add_option("--cameras", o.cameras)->delimiter(',');
  app.add_option("--tests", o.tests)->delimiter(',');
  app.add_option("--without", o.without);
  app.add_option("--avatar", o.avatar, "Drive this one, and learn nothing");
  app.add_option("--calibration", o.training.calibration_frames);
  app.add_option("--every", o.every);
  app.add_option("--max-frames", o.training.max_frames, "To learn from, evenly chosen");
  app.add_option("--shares", o.shares, "Learn from these first shares of each take, one after another")
      ->delimiter(',');
  app.add_option("--most", o.most);
  app.add_option("--net", o.net);
  app.add_option("--level", o.level);
  app.add_option("--gutter", o.gutter);
  app.add_option("--corrected", o.driving.driver.corrected_sigma_mm);
  app.add_option("--dark-from", o.dark_from);
  app.add_option("--components", o.training.components);
  app.add_option("--view-rays", o.driving.driver.tracker.rays_of_view);
  app.add_option("--regions", o.driving.driver.tracker.local.regions);
  app.add_option("--local-components", o.driving.driver.tracker.local.components);
  app.add_option("--spread", o.driving.driver.tracker.local.spread);
  app.add_option("--robust", o.driving.driver.tracker.robust_spreads);
  app.add_option("--strain", o.driving.driver.polish.fit.least_strain);
  app.add_option("--tail", o.driving.driver.polish.fit.tail_freedom);
  app.add_option("--bend", o.driving.driver.polish.fit.bend_share);
  app.add_option("--carrier", o.driving.driver.polish.carrier_sigma_mm);
  app.add_option("--steps", o.driving.driver.polish.fit.max_steps);
  app.add_option("--tolerance", o.driving.driver.polish.fit.tolerance_mm);
  app.add_option("--rounds", o.driving.driver.polish.rounds);
  app.add_option("--cloth-sigma", o.driving.cloth_sigma_px);
  CLI11_PARSE(app, argc, argv);
  weft::Run(o);
}
