#include "services/animation/score_avatar.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "alignment/placement.h"
#include "animation/evidence.h"
#include "base/median.h"
#include "base/stopwatch.h"
#include "evaluation/driving_score.h"
#include "services/animation/avatar_file.h"
#include "services/animation/avatar_goals.h"
#include "services/animation/cloth_take.h"
#include "services/animation/observed_take.h"
#include "services/animation/truth_views.h"
#include "services/files/atomic_file.h"
#include "services/files/mesh_file.h"
#include "services/synthetic/dataset_file.h"

namespace weft {
namespace {

constexpr char kDriven[] = "driven", kCarrier[] = "carrier", kBestShape[] = "best shape",
               kMeanShape[] = "mean shape", kElsewhere[] = "elsewhere", kOneDark[] = "one dark",
               kAfterDark[] = "after dark", kNeverDark[] = "never dark";
// Two cameras in other places: the arc between them, and how far they are.
constexpr DrivingPlaces kOtherPlaces[] = {{140, 3000}, {220, 1600}};
// When the first camera is dark, and how long after it the error is as it was.
constexpr int kDarkFrom = 10, kDarkFrames = 15, kAfter = 10;

// Of one split, number of cameras and method.
struct Tally {
  DrivingScore score;
  int lost_frames = 0;
  std::vector<double> ms;
};

// Methods in the order in which they are printed.
class ScoreTable {
 public:
  Tally& At(const std::string& split, int cameras, const std::string& method) {
    for (auto& [key, tally] : rows_)
      if (key == Key{split, cameras, method}) return tally;
    rows_.push_back({{split, cameras, method}, {}});
    return rows_.back().second;
  }

  void WriteTo(int threads, v1::AvatarEvaluation& out) const {
    for (const auto& [key, tally] : rows_) {
      if (tally.score.frames() == 0 && tally.lost_frames == 0) continue;
      v1::AvatarScore& row = *out.add_scores();
      row.set_split(key.split);
      row.set_cameras(key.cameras);
      row.set_method(key.method);
      Fill(tally, row);
      if (tally.ms.empty()) continue;
      row.set_ms_a_frame(Median(tally.ms));
      row.set_threads(threads);
    }
  }

 private:
  struct Key {
    std::string split;
    int cameras;
    std::string method;
    bool operator==(const Key&) const = default;
  };

  static void Fill(const Tally& tally, v1::AvatarScore& row) {
    const DrivingScore& score = tally.score;
    const auto mean = [](const ErrorTally& errors) { return errors.Summary().value_or(ErrorSummary()).mean; };
    row.set_frames(score.frames());
    row.set_lost_frames(tally.lost_frames);
    const ErrorSummary all = score.all_mm().Summary().value_or(ErrorSummary());
    row.set_mean_mm(all.mean);
    row.set_median_mm(all.median);
    row.set_p95_mm(all.p95);
    row.set_across_mm(mean(score.across_mm()));
    row.set_seen_mm(mean(score.seen_mm()));
    row.set_unseen_mm(mean(score.unseen_mm()));
    row.set_unseen_share(score.UnseenShare().value_or(0));
    row.set_chamfer_mm(mean(score.chamfer_mm()));
    row.set_trembling_seen_mm(mean(score.trembling_seen_mm()));
    row.set_trembling_unseen_mm(mean(score.trembling_unseen_mm()));
    row.set_share_within_sigma(score.ShareWithin(1).value_or(-1));
    row.set_share_within_two_sigma(score.ShareWithin(2).value_or(-1));
    row.set_lost_vertices(score.lost());
  }

  std::vector<std::pair<Key, Tally>> rows_;
};

class AvatarScorer {
 public:
  AvatarScorer(const AvatarScoring& scoring, const SparseViewAvatar& avatar, const Template& garment,
               const std::stop_token& stop)
      : scoring_(scoring),
        avatar_(avatar),
        garment_(garment),
        stop_(stop),
        driving_(scoring.threads),
        nodes_(garment) {
    for (size_t v = 0; v < garment.rest.vertices_mm.size(); ++v)
      mean_.emplace_back(avatar.space.mean_mm[3 * v], avatar.space.mean_mm[3 * v + 1],
                         avatar.space.mean_mm[3 * v + 2]);
  }

  // `on_frame` is called once for each frame and number of cameras.
  absl::Status Score(ClothTake& take, const std::function<void()>& on_frame,
                     std::vector<std::string>& remarks) {
    const std::string split = take.split.empty() ? take.name() : take.split;
    bool knows_shapes = false;
    for (const int cameras : scoring_.cameras) {
      absl::StatusOr<std::unique_ptr<ObservedTake>> seen =
          ObserveTake(take, garment_, cameras, scoring_.seed);
      if (absl::IsOutOfRange(seen.status())) {
        remarks.emplace_back(seen.status().message());
        continue;
      }
      if (!seen.ok()) return seen.status();
      if (absl::Status status = Drive(take, split, cameras, **seen, !knows_shapes, on_frame); !status.ok())
        return status;
      knows_shapes = true;
    }
    const bool has_pictures = !take.frame_names().empty();
    return scoring_.with_trials && !has_pictures ? TryElsewhereAndDark(take, split) : absl::OkStatus();
  }

  int FramesOf(const ClothTake& take) const {
    return scoring_.max_frames > 0 ? std::min(scoring_.max_frames, take.frames()) : take.frames();
  }
  const ScoreTable& table() const { return table_; }

 private:
  absl::Status Drive(ClothTake& take, const std::string& split, int cameras, ObservedTake& seen,
                     bool with_shapes, const std::function<void()>& on_frame) {
    absl::StatusOr<SparseViewDriver> driver = SparseViewDriver::Create(garment_, avatar_);
    if (!driver.ok()) return driver.status();
    Tally driven_sum, carrier_sum, best_sum, mean_sum;
    bool follows = false;
    for (int k = 0; k < FramesOf(take); ++k) {
      if (stop_.stop_requested()) return absl::CancelledError("the evaluation was stopped");
      const absl::StatusOr<ClothFrame> truth = take.Read(k);
      if (!truth.ok()) return truth.status();
      const absl::StatusOr<std::vector<ViewObservations>> views = seen.Look(k, *truth);
      if (!views.ok()) return views.status();
      const absl::StatusOr<DrivenFrame> driven =
          DriveTimed(*driver, truth->time_ns, *views, seen.rig(), driven_sum);
      if (!driven.ok()) return driven.status();
      const VertexRays rays = RaysOf(*views, seen.rig());
      absl::Status status;
      if (driven->lost) {
        ++driven_sum.lost_frames, ++carrier_sum.lost_frames;
      } else {
        status = driven_sum.score.Add({driven->mesh.vertices_mm, driven->mesh.sigma_mm}, truth->vertices_mm,
                                      rays, follows);
        status.Update(carrier_sum.score.Add({driven->carrier_mm, {}}, truth->vertices_mm, rays, follows));
        if (!scoring_.meshes.empty()) status.Update(WriteMeshes(take, cameras, k, *driven, *truth));
      }
      if (with_shapes) status.Update(AddShapes(truth->vertices_mm, rays, k > 0, best_sum, mean_sum));
      if (!status.ok()) return status;
      follows = !driven->lost;
      if (on_frame) on_frame();
    }
    const auto add = [&](const char* method, int of_cameras, const Tally& sum) {
      Tally& to = table_.At(split, of_cameras, method);
      to.score += sum.score;
      to.lost_frames += sum.lost_frames;
      to.ms.insert(to.ms.end(), sum.ms.begin(), sum.ms.end());
    };
    if (with_shapes) add(kMeanShape, 0, mean_sum), add(kBestShape, 0, best_sum);
    add(kCarrier, cameras, carrier_sum);
    add(kDriven, cameras, driven_sum);
    return absl::OkStatus();
  }

  // Frame by frame: `dark` says whether the first camera is, `tally_of` what to add a frame to, or null.
  absl::Status DriveInto(ClothTake& take, ObservedTake& seen, const std::function<bool(int)>& dark,
                         const std::function<Tally*(int)>& tally_of) {
    absl::StatusOr<SparseViewDriver> driver = SparseViewDriver::Create(garment_, avatar_);
    if (!driver.ok()) return driver.status();
    for (int k = 0; k < FramesOf(take); ++k) {
      if (stop_.stop_requested()) return absl::CancelledError("the evaluation was stopped");
      const absl::StatusOr<ClothFrame> truth = take.Read(k);
      if (!truth.ok()) return truth.status();
      absl::StatusOr<std::vector<ViewObservations>> views = seen.Look(k, *truth);
      if (!views.ok()) return views.status();
      if (dark(k)) views->front().observations.clear();
      Tally unused;
      Tally* const tally = tally_of(k);
      Tally& sum = tally != nullptr ? *tally : unused;
      const absl::StatusOr<DrivenFrame> driven = DriveTimed(*driver, truth->time_ns, *views, seen.rig(), sum);
      if (!driven.ok()) return driven.status();
      if (driven->lost) {
        ++sum.lost_frames;
        continue;
      }
      const absl::Status status = sum.score.Add({driven->mesh.vertices_mm, driven->mesh.sigma_mm},
                                                truth->vertices_mm, RaysOf(*views, seen.rig()), false);
      if (!status.ok()) return status;
    }
    return absl::OkStatus();
  }

  absl::Status TryElsewhereAndDark(ClothTake& take, const std::string& split) {
    const absl::StatusOr<ClothFrame> first = take.Read(0);
    if (!first.ok()) return first.status();
    const auto never = [](int) { return false; };
    for (const DrivingPlaces& places : kOtherPlaces) {
      absl::StatusOr<Rig> rig = DrivingRig(2, first->vertices_mm, scoring_.seed, places);
      if (!rig.ok()) return rig.status();
      const auto seen = ObserveFrom(take, garment_, *std::move(rig), scoring_.seed);
      const auto tally = [&](int) { return &table_.At(split, 2, kElsewhere); };
      if (absl::Status status = DriveInto(take, *seen, never, tally); !status.ok()) return status;
    }
    constexpr int kDarkEnd = kDarkFrom + kDarkFrames, kBack = kDarkEnd + kAfter;
    if (FramesOf(take) < kBack + kAfter) return absl::OkStatus();
    const auto seen = ObserveTake(take, garment_, 2, scoring_.seed);
    if (!seen.ok()) return seen.status();
    const auto dark = [](int k) { return k >= kDarkFrom && k < kDarkEnd; };
    const auto is_after = [](int k) { return k >= kBack && k < kBack + kAfter; };
    absl::Status status = DriveInto(take, **seen, dark, [&](int k) -> Tally* {
      if (dark(k)) return &table_.At(split, 2, kOneDark);
      return is_after(k) ? &table_.At(split, 2, kAfterDark) : nullptr;
    });
    if (!status.ok()) return status;
    return DriveInto(take, **seen, never, [&](int k) -> Tally* {
      return is_after(k) ? &table_.At(split, 2, kNeverDark) : nullptr;
    });
  }

  absl::Status WriteMeshes(const ClothTake& take, int cameras, int frame, const DrivenFrame& driven,
                           const ClothFrame& truth) const {
    const std::filesystem::path folder =
        std::filesystem::path(scoring_.meshes) /
        absl::StrCat(std::filesystem::path(take.name()).filename().string(), "-", cameras) /
        absl::StrFormat("%04d", frame);
    absl::Status status = CreateFolders(folder.string());
    if (!status.ok()) return status;
    status = WriteRegisteredMesh((folder / "mesh.ply").string(), driven.mesh, garment_.rest.faces);
    if (!status.ok()) return status;
    return WriteMesh((folder / "truth.ply").string(), {truth.vertices_mm, garment_.rest.faces});
  }

  absl::StatusOr<DrivenFrame> DriveTimed(SparseViewDriver& driver, int64_t time_ns,
                                         const std::vector<ViewObservations>& seen, const Rig& rig,
                                         Tally& sum) {
    std::vector<DrivingView> views;
    for (const ViewObservations& view : seen)
      views.push_back({&rig.cameras[static_cast<size_t>(view.camera)], view.observations});
    absl::StatusOr<DrivenFrame> driven;
    const Stopwatch watch;
    driving_.execute([&] { driven = driver.Drive(time_ns, views); });
    sum.ms.push_back(watch.Ms());
    return driven;
  }

  VertexRays RaysOf(const std::vector<ViewObservations>& views, const Rig& rig) const {
    VertexRays out(garment_.rest.vertices_mm.size());
    for (const ViewObservations& view : views)
      for (const Observation& o : view.observations) {
        const int vertex = nodes_.VertexOf(o.node);
        const auto ray = rig.cameras[static_cast<size_t>(view.camera)].PixelRay({o.x_px, o.y_px});
        if (vertex >= 0 && ray) out.Add(static_cast<size_t>(vertex), ray->direction);
      }
    return out;
  }

  // What the shapes could do at best, and without any component.
  absl::Status AddShapes(const std::vector<Eigen::Vector3d>& truth_mm, const VertexRays& rays, bool follows,
                         Tally& best_sum, Tally& mean_sum) const {
    const auto moved = [](const Eigen::Isometry3d& by, std::vector<Eigen::Vector3d> points) {
      for (Eigen::Vector3d& p : points) p = by * p;
      return points;
    };
    Eigen::Isometry3d to_space = RigidFit(truth_mm, mean_);
    absl::Status status = mean_sum.score.Add({moved(to_space.inverse(), mean_), {}}, truth_mm, rays, follows);
    std::vector<Eigen::Vector3d> shape;
    for (int round = 0; round < 2; ++round) {
      shape = avatar_.space.Shape(avatar_.space.Project(moved(to_space, truth_mm)));
      to_space = RigidFit(truth_mm, shape);
    }
    status.Update(best_sum.score.Add({moved(to_space.inverse(), shape), {}}, truth_mm, rays, follows));
    return status;
  }

  const AvatarScoring& scoring_;
  const SparseViewAvatar& avatar_;
  const Template& garment_;
  const std::stop_token& stop_;
  tbb::task_arena driving_;
  NodeVertices nodes_;
  std::vector<Eigen::Vector3d> mean_;
  ScoreTable table_;
};

absl::Status AddFloor(const std::string& folder, v1::AvatarEvaluation& out) {
  const absl::StatusOr<v1::Dataset> dataset = ReadDatasetFile(folder);
  if (!dataset.ok()) return dataset.status();
  const absl::StatusOr<std::vector<TakeFloor>> floor = MeasureFloor(*dataset, folder);
  if (!floor.ok()) return floor.status();
  for (const TakeFloor& take : *floor) {
    v1::AvatarFloor& to = *out.add_floor();
    to.set_take(take.take);
    to.set_frames(take.frames);
    to.set_mean_mm(take.distance_mm.mean);
    to.set_median_mm(take.distance_mm.median);
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status AvatarScoring::Validate() const {
  if (sources.empty()) return absl::InvalidArgumentError("no take to be driven is given");
  if (cameras.empty()) return absl::InvalidArgumentError("cameras: no number of them is given");
  for (const int count : cameras)
    if (count < 1 || count > 1000)
      return absl::InvalidArgumentError(absl::StrCat("cameras: ", count, " of them, expected 1 to 1000"));
  if (max_frames < 0) return absl::InvalidArgumentError("max_frames must not be negative");
  if (!(fps >= 0)) return absl::InvalidArgumentError("fps must not be negative");
  if (threads < 1) return absl::InvalidArgumentError("threads must be 1 or more");
  return absl::OkStatus();
}

absl::StatusOr<v1::AvatarEvaluation> ScoreAvatar(const AvatarScoring& scoring,
                                                 const std::function<void(size_t done, size_t all)>& on_frame,
                                                 const std::stop_token& stop) {
  if (absl::Status status = scoring.Validate(); !status.ok()) return status;
  const absl::StatusOr<AvatarFile> avatar = ReadAvatar(scoring.avatar);
  if (!avatar.ok()) return avatar.status();
  std::vector<ClothSource> sources;
  v1::AvatarEvaluation out;
  out.set_avatar(scoring.avatar);
  for (const std::string& folder : scoring.sources) {
    absl::StatusOr<ClothSource> source = OpenClothSource(folder, scoring.fps);
    if (!source.ok()) return source.status();
    if (source->is_dataset)
      if (absl::Status status = AddFloor(folder, out); !status.ok()) return status;
    sources.push_back(*std::move(source));
  }
  const absl::StatusOr<SharedTemplate> garment = TemplateOfSources(sources, scoring.garment);
  if (!garment.ok()) return garment.status();
  if (absl::Status status = CheckAvatarFits(*avatar, scoring.avatar, garment->garment, garment->path);
      !status.ok())
    return status;
  out.set_template_hash(avatar->about.template_hash());

  std::vector<ClothTake*> takes;
  for (ClothSource& source : sources)
    for (ClothTake& take : source.takes) {
      const bool is_asked_for =
          std::find(scoring.splits.begin(), scoring.splits.end(), take.split) != scoring.splits.end();
      if (!source.is_dataset || is_asked_for) takes.push_back(&take);
      if (take.folder.empty())
        return absl::InvalidArgumentError(absl::StrCat(
            take.name(),
            ": is no simulated take, so its truth is not known; `weft evaluate` measures results"));
    }
  if (takes.empty())
    return absl::NotFoundError(absl::StrCat(scoring.sources.front(), ": has no complete take of the splits ",
                                            absl::StrJoin(scoring.splits, ", ")));
  AvatarScorer scorer(scoring, avatar->avatar, garment->garment, stop);
  size_t all = 0, done = 0;
  for (const ClothTake* take : takes)
    all += static_cast<size_t>(scorer.FramesOf(*take)) * scoring.cameras.size();
  std::vector<std::string> remarks;
  for (ClothTake* take : takes) {
    const auto one_more = [&] {
      if (on_frame) on_frame(++done, all);
    };
    if (absl::Status status = scorer.Score(*take, one_more, remarks); !status.ok()) return status;
  }
  scorer.table().WriteTo(scoring.threads, out);
  for (const std::string& remark : remarks) out.add_remarks(remark);
  AddAvatarGoals(avatar->about, out);
  return out;
}

}  // namespace weft
