#include "services/work/animation/score_avatar.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <string_view>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "animation/paper/pixel_driver.h"
#include "animation/rays/evidence.h"
#include "animation/rays/ray_polish.h"
#include "base/status_macros.h"
#include "evaluation/driving_score.h"
#include "figure/motion_generator.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/work/animation/avatar_file.h"
#include "services/work/animation/avatar_text.h"
#include "services/work/animation/baseline_meshes.h"
#include "services/work/animation/cloth_take.h"
#include "services/work/animation/driving_trials.h"
#include "services/work/animation/driving_views.h"
#include "services/work/animation/observed_take.h"
#include "services/work/animation/paper_baseline.h"
#include "services/work/animation/score_table.h"
#include "services/work/animation/seam_vertices.h"
#include "services/work/animation/timed_driver.h"

namespace weft {
namespace {

constexpr char kDriven[] = "driven", kCarrier[] = "carrier", kBestShape[] = "best shape",
               kMeanShape[] = "mean shape", kWithoutNet[] = "without net", kRegistered[] = "registered",
               kSkinned[] = "skinned", kSkinnedPolished[] = "skinned + rays", kImitated[] = "imitated",
               kHandBefore[] = "hand before";
// So many cameras are enough to register by, and so many at most are compared with skinned cloth.
constexpr int kCamerasToRegister = 8, kCamerasToSkin = 3;
// So near to a seam a vertex is at it.
constexpr int kTexelsOfSeam = 2;
// The motion in which a hand is before the garment.
const std::string_view kReaching = NameOf(MotionKind::kReach);

// One frame before some cameras.
struct FrameInView {
  const ClothFrame& truth;
  const std::vector<ViewObservations>& views;
  const Rig& rig;
  VertexRays rays;
  const std::string& split;
  int cameras;
  bool follows;  // it is not the first of its take
};

class AvatarScorer {
 public:
  // `baseline` may be null.
  AvatarScorer(const AvatarScoring& scoring, const SparseViewAvatar& avatar, const PixelAvatar* baseline,
               const Template& garment, std::vector<bool> near_seams, const std::stop_token& stop)
      : scoring_(scoring),
        avatar_(avatar),
        garment_(garment),
        stop_(stop),
        driving_(scoring.threads),
        observing_{garment, scoring.seed, scoring.films},
        trials_(garment, avatar, baseline, observing_, driving_, stop),
        nodes_(garment),
        model_(garment),
        registration_(garment),
        skinned_polish_(model_, avatar.edges(), SparseViewOptions().driver.polish),
        paper_(garment, baseline),
        near_seams_(std::move(near_seams)) {}

  // `on_frame` is called once for each frame and number of cameras.
  absl::Status Score(ClothTake& take, const std::function<void()>& on_frame,
                     std::vector<std::string>& remarks) {
    const std::string split = take.split.empty() ? take.name() : take.split;
    const bool has_pictures = !take.frame_names().empty();
    bool knows_shapes = false;
    for (const int cameras : scoring_.cameras) {
      absl::StatusOr<std::unique_ptr<ObservedTake>> seen = ObserveTake(take, cameras, observing_);
      if (absl::IsOutOfRange(seen.status())) {
        remarks.emplace_back(seen.status().message());
        continue;
      }
      if (!seen.ok()) return seen.status();
      WEFT_RETURN_IF_ERROR(Drive(take, split, cameras, **seen, !knows_shapes, on_frame));
      if (scoring_.films && !has_pictures) WEFT_RETURN_IF_ERROR(DriveImitated(take, split, cameras));
      knows_shapes = true;
    }
    if (!scoring_.with_trials || has_pictures) return absl::OkStatus();
    return trials_.TryAll(take, split, FramesOf(take), table_);
  }

  FrameRange FramesOf(const ClothTake& take) const {
    const auto all = static_cast<size_t>(take.frames());
    return {std::min(scoring_.frames.first, all), std::min(scoring_.frames.end, all)};
  }
  const ScoreTable& table() const { return table_; }

 private:
  absl::Status Drive(ClothTake& take, const std::string& split, int cameras, ObservedTake& seen,
                     bool with_shapes, const std::function<void()>& on_frame) {
    WEFT_ASSIGN_OR_RETURN(TimedDriver driver, TimedDriver::Create(garment_, avatar_, driving_));
    ScoreTable sums;  // of this take: jitter is measured within takes
    std::optional<SkinnedBaseline> skinned;
    WEFT_RETURN_IF_ERROR(paper_.Begin(cameras));
    bool follows = false;
    const FrameRange frames = FramesOf(take);
    const auto first = static_cast<int>(frames.first);
    for (int k = first; k < static_cast<int>(frames.end); ++k) {
      if (stop_.stop_requested()) return absl::CancelledError("the evaluation was stopped");
      WEFT_ASSIGN_OR_RETURN(const ClothFrame truth, take.Read(k));
      WEFT_ASSIGN_OR_RETURN(const std::vector<ViewObservations> views, seen.Observe(k, truth));
      const FrameInView frame{truth, views,   seen.rig(), DirectionsOf(views, seen.rig(), garment_, nodes_),
                              split, cameras, k > first};
      absl::Status status;
      if (with_shapes) status.Update(AddShapes(frame, sums));
      std::vector<double> ms;
      WEFT_ASSIGN_OR_RETURN(const DrivenFrame driven, driver.Drive(truth.time_ns, views, seen.rig(), ms));
      for (const char* method : {kCarrier, kDriven})
        sums.At(split, cameras, method).lost_frames += driven.lost ? 1 : 0;
      if (!driven.lost) {
        status.Update(AddMesh(frame, kCarrier, driven.carrier_mm, {}, follows, sums));
        if (!driven.uncorrected_mm.empty())
          status.Update(AddMesh(frame, kWithoutNet, driven.uncorrected_mm, {}, follows, sums));
        status.Update(AddMesh(frame, kDriven, driven.mesh.vertices_mm, driven.mesh.sigma_mm, follows, sums));
        AddBySeams(driven.mesh.vertices_mm, truth.vertices_mm, sums.At(split, cameras, kDriven));
        if (!scoring_.meshes.empty()) status.Update(WriteMeshes(take, cameras, k, driven, truth));
        if (cameras >= kCamerasToRegister) status.Update(AddRegistered(frame, driven.mesh, sums));
      }
      ScoreTally& sum = sums.At(split, cameras, kDriven);
      sum.ms.insert(sum.ms.end(), ms.begin(), ms.end());
      sum.AddViews(views);
      const bool skins = truth.pose.has_value() && cameras <= kCamerasToSkin;
      if (skins && !skinned) skinned.emplace(model_.graph(), take.body, truth.vertices_mm, *truth.pose);
      if (skins) status.Update(AddSkinned(frame, *skinned, sums));
      status.Update(paper_.Add({truth, views, frame.rig, frame.rays, k > first}, split, "", driving_, sums));
      if (!status.ok()) return status;
      follows = !driven.lost;
      if (on_frame) on_frame();
    }
    table_ += sums;
    if (take.motion == kReaching) table_.At(split, cameras, kHandBefore) += sums.At(split, cameras, kDriven);
    return absl::OkStatus();
  }

  // The same frames with the decoder imitated.
  absl::Status DriveImitated(ClothTake& take, const std::string& split, int cameras) {
    const Observing imitating{garment_, scoring_.seed};
    WEFT_ASSIGN_OR_RETURN(const auto seen, ObserveTake(take, cameras, imitating));
    DrivingTrial trial;
    trial.tally_of = [&](int) { return &table_.At(split, cameras, kImitated); };
    return trials_.Drive(take, *seen, FramesOf(take), trial);
  }

  absl::Status AddMesh(const FrameInView& frame, const char* method,
                       const std::vector<Eigen::Vector3d>& vertices_mm, const std::vector<float>& sigma_mm,
                       bool follows, ScoreTable& sums) const {
    DrivingScore& score = sums.At(frame.split, frame.cameras, method).score;
    return score.Add({vertices_mm, sigma_mm}, frame.truth.vertices_mm, frame.rays, follows);
  }

  void AddBySeams(const std::vector<Eigen::Vector3d>& vertices_mm,
                  const std::vector<Eigen::Vector3d>& truth_mm, ScoreTally& sum) const {
    for (size_t v = 0; v < truth_mm.size(); ++v)
      (near_seams_[v] ? sum.at_seams_mm : sum.off_seams_mm).push_back((vertices_mm[v] - truth_mm[v]).norm());
  }

  // Frames that cannot be registered are counted as lost.
  absl::Status AddRegistered(const FrameInView& frame, const RegisteredMesh& driven, ScoreTable& sums) {
    absl::StatusOr<RegisteredMesh> mesh;
    driving_.execute([&] { mesh = registration_.Register(frame.rig, frame.views); });
    if (absl::IsFailedPrecondition(mesh.status())) {
      ++sums.At(frame.split, frame.cameras, kRegistered).lost_frames;
      return absl::OkStatus();
    }
    if (!mesh.ok()) return mesh.status();
    ErrorTally& apart_mm = sums.At(frame.split, frame.cameras, kDriven).from_registered_mm;
    for (size_t v = 0; v < mesh->state.size(); ++v)
      if (mesh->state[v] == VertexState::kObserved || mesh->state[v] == VertexState::kTwoView)
        apart_mm.push_back((driven.vertices_mm[v] - mesh->vertices_mm[v]).norm());
    return AddMesh(frame, kRegistered, mesh->vertices_mm, {}, frame.follows, sums);
  }

  // Skinning knows the pose that nobody tells the driver; the polish is the driver's own.
  absl::Status AddSkinned(const FrameInView& frame, const SkinnedBaseline& skinned, ScoreTable& sums) {
    const std::vector<Eigen::Vector3d> carrier = skinned.MeshIn(*frame.truth.pose);
    absl::Status status = AddMesh(frame, kSkinned, carrier, {}, frame.follows, sums);
    WEFT_ASSIGN_OR_RETURN(
        const std::vector<VertexRay> rays,
        RaysOf(DrivingViewsOf(frame.views, frame.rig), nodes_, SparseViewOptions().cloth_sigma_px));
    absl::StatusOr<PolishedMesh> polished;
    driving_.execute([&] { polished = skinned_polish_.Polish(carrier, carrier, rays); });
    if (!polished.ok()) return polished.status();
    status.Update(AddMesh(frame, kSkinnedPolished, polished->position_mm, {}, frame.follows, sums));
    return status;
  }

  absl::Status WriteMeshes(const ClothTake& take, int cameras, int frame, const DrivenFrame& driven,
                           const ClothFrame& truth) const {
    const std::filesystem::path folder =
        std::filesystem::path(scoring_.meshes) /
        absl::StrCat(std::filesystem::path(take.name()).filename().string(), "-", cameras) /
        absl::StrFormat("%04d", frame);
    WEFT_RETURN_IF_ERROR(CreateFolders(folder.string()));
    WEFT_RETURN_IF_ERROR(
        WriteRegisteredMesh((folder / "mesh.ply").string(), driven.mesh, garment_.rest.faces));
    return WriteMesh((folder / "truth.ply").string(), {truth.vertices_mm, garment_.rest.faces});
  }

  // What the shapes could do at best, and without any component.
  absl::Status AddShapes(const FrameInView& frame, ScoreTable& sums) const {
    const PlacedShapes shapes = PlaceShapes(avatar_.space, frame.truth.vertices_mm);
    const auto add = [&](const char* method, const std::vector<Eigen::Vector3d>& vertices_mm) {
      DrivingScore& score = sums.At(frame.split, 0, method).score;
      return score.Add({vertices_mm, {}}, frame.truth.vertices_mm, frame.rays, frame.follows);
    };
    absl::Status status = add(kMeanShape, shapes.mean_mm);
    status.Update(add(kBestShape, shapes.best_mm));
    return status;
  }

  const AvatarScoring& scoring_;
  const SparseViewAvatar& avatar_;
  const Template& garment_;
  const std::stop_token& stop_;
  tbb::task_arena driving_;
  Observing observing_;
  DrivingTrials trials_;
  NodeVertices nodes_;
  AlignmentModel model_;
  RegistrationBaseline registration_;
  RayPolish skinned_polish_;
  PaperBaseline paper_;
  std::vector<bool> near_seams_;
  ScoreTable table_;
};

}  // namespace

absl::Status AvatarScoring::Validate() const {
  if (sources.empty()) return absl::InvalidArgumentError("no take to be driven is given");
  if (cameras.empty()) return absl::InvalidArgumentError("cameras: no number of them is given");
  for (const int count : cameras)
    if (count < 1 || count > 1000)
      return absl::InvalidArgumentError(absl::StrCat("cameras: ", count, " of them, expected 1 to 1000"));
  if (frames.first >= frames.end)
    return absl::InvalidArgumentError("frames: the range must end behind its first frame");
  if (!(fps >= 0)) return absl::InvalidArgumentError("fps must not be negative");
  if (threads < 1) return absl::InvalidArgumentError("threads must be 1 or more");
  return absl::OkStatus();
}

absl::StatusOr<v1::AvatarEvaluation> ScoreAvatar(const AvatarScoring& scoring,
                                                 const std::function<void(size_t done, size_t all)>& on_frame,
                                                 const std::stop_token& stop) {
  WEFT_RETURN_IF_ERROR(scoring.Validate());
  WEFT_ASSIGN_OR_RETURN(const AvatarFile avatar, ReadAvatar(scoring.avatar));
  std::vector<ClothSource> sources;
  v1::AvatarEvaluation out;
  out.set_avatar(scoring.avatar);
  for (const std::string& folder : scoring.sources) {
    WEFT_ASSIGN_OR_RETURN(ClothSource source, OpenClothSource(folder, scoring.fps));
    if (source.is_dataset) WEFT_RETURN_IF_ERROR(AddChaosFloor(folder, out));
    sources.push_back(std::move(source));
  }
  WEFT_ASSIGN_OR_RETURN(const SharedTemplate garment, TemplateOfSources(sources, scoring.garment));
  WEFT_RETURN_IF_ERROR(CheckAvatarFits(avatar.about, scoring.avatar, garment.garment, garment.path));
  out.set_template_hash(avatar.about.template_hash());
  WEFT_ASSIGN_OR_RETURN(const auto baseline, ReadBaseline(scoring.baseline, garment.garment, garment.path));

  std::vector<ClothTake*> takes;
  for (ClothSource& source : sources)
    for (ClothTake& take : source.takes) {
      const bool is_asked_for = std::ranges::find(scoring.splits, take.split) != scoring.splits.end();
      if (!source.is_dataset || is_asked_for) takes.push_back(&take);
      if (take.folder.empty())
        return absl::InvalidArgumentError(absl::StrCat(
            take.name(),
            ": is no simulated take, so its truth is not known; `weft evaluate` measures results"));
    }
  if (takes.empty())
    return absl::NotFoundError(absl::StrCat(scoring.sources.front(), ": has no complete take of the splits ",
                                            absl::StrJoin(scoring.splits, ", ")));
  WEFT_ASSIGN_OR_RETURN(std::vector<bool> near_seams,
                        VerticesNearSeams(garment.garment, avatar.avatar.net.atlas, kTexelsOfSeam));
  AvatarScorer scorer(scoring, avatar.avatar, baseline ? &*baseline : nullptr, garment.garment,
                      std::move(near_seams), stop);
  size_t all = 0, done = 0;
  for (const ClothTake* take : takes) {
    const FrameRange frames = scorer.FramesOf(*take);
    if (frames.first >= frames.end)
      return absl::InvalidArgumentError(absl::StrCat("frames: ", take->name(), " has ", take->frames(),
                                                     ", none of them from ", scoring.frames.first, " on"));
    all += (frames.end - frames.first) * scoring.cameras.size();
  }
  std::vector<std::string> remarks;
  for (ClothTake* take : takes) {
    const auto one_more = [&] {
      if (on_frame) on_frame(++done, all);
    };
    WEFT_RETURN_IF_ERROR(scorer.Score(*take, one_more, remarks));
  }
  scorer.table().WriteTo(scoring.threads, out);
  for (const std::string& remark : remarks) out.add_remarks(remark);
  for (const std::string& remark : BaselineRemarks(out)) out.add_remarks(remark);
  return out;
}

}  // namespace weft
