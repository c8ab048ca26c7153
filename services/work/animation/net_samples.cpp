#include "services/work/animation/net_samples.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "animation/sparse_view/driving_features.h"
#include "animation/sparse_view/ray_driver.h"
#include "animation/sparse_view/sparse_view_driver.h"
#include "base/counter_random.h"
#include "base/status_macros.h"
#include "services/work/animation/cloth_take.h"
#include "services/work/animation/driving_views.h"
#include "services/work/animation/observed_take.h"
#include "services/work/animation/sample_writer.h"
#include "services/work/animation/truth_views.h"
#include "simulation/studio_rig.h"
#include "simulation/take_presets.h"

namespace weft {
namespace {

constexpr int kOffsets = 3;

// Motions are left out one by one, or together where there are more.
constexpr size_t kMostGroups = 8;
// A space of fewer says nothing of others.
constexpr int kLeastLearnt = 20;
constexpr uint32_t kTrain = 0, kValidate = 1;  // of the file

// A run of frames of a take that a space never saw.
struct Drive {
  int take = 0, first = 0, last = 0;
  size_t space = 0;
  uint32_t split = kTrain;
  int rig = 0, cameras = 2;
};

// Frames of a take that a space is learnt from.
struct Part {
  int take = 0, first = 0, last = 0;
};

// Which spaces are learnt, and what each drives.
struct Plan {
  std::vector<std::vector<Part>> spaces;  // the first has all that is learnt from
  std::vector<Drive> drives;
};

int FramesOf(const std::vector<Part>& parts) {
  int out = 0;
  for (const Part& part : parts) out += part.last - part.first;
  return out;
}

Plan PlanOf(TrainingTakes& takes, int rigs) {
  const std::vector<TrainingTake> told = takes.Frames().takes;
  Plan out;
  out.spaces.emplace_back();
  std::vector<std::string> motions;
  std::vector<Part> learnt(told.size());
  for (size_t t = 0; t < told.size(); ++t) {
    learnt[t] = {static_cast<int>(t), 0, LearntFrames(told, t)};
    if (learnt[t].last == 0) continue;
    out.spaces[0].push_back(learnt[t]);
    if (std::ranges::find(motions, told[t].motion) == motions.end()) motions.push_back(told[t].motion);
  }
  const auto group_of = [&](size_t t) {
    return static_cast<size_t>(std::ranges::find(motions, told[t].motion) - motions.begin()) % kMostGroups;
  };
  // By a space of these parts, what it has not learnt.
  const auto add = [&](std::vector<Part> parts, const std::vector<Part>& driven) {
    if (FramesOf(parts) < kLeastLearnt) return;
    for (const Part& part : driven)
      for (int rig = 0; rig < rigs; ++rig)
        out.drives.push_back({part.take, part.first, part.last, out.spaces.size(), kTrain, rig});
    out.spaces.push_back(std::move(parts));
  };
  std::vector<Part> first_halves, last_halves;
  for (const Part& part : out.spaces[0]) {
    first_halves.push_back({part.take, 0, part.last / 2});
    last_halves.push_back({part.take, part.last / 2, part.last});
  }
  add(first_halves, last_halves);
  add(last_halves, first_halves);
  for (size_t group = 0; group < std::min(motions.size(), kMostGroups); ++group) {
    std::vector<Part> of_group, others;
    for (size_t t = 0; t < told.size(); ++t)
      if (learnt[t].last > 0) (group_of(t) == group ? of_group : others).push_back(learnt[t]);
    add(std::move(others), of_group);
  }
  for (size_t t = 0; t < told.size(); ++t)
    for (int rig = 0; rig < rigs && learnt[t].last < told[t].frames; ++rig)
      out.drives.push_back({static_cast<int>(t), learnt[t].last, told[t].frames, 0, kValidate, rig});
  // Two and three cameras in turn; four now and then, but to train.
  for (size_t k = 0; k < out.drives.size(); ++k)
    out.drives[k].cameras = out.drives[k].split == kTrain && k % 7 == 6 ? 4 : 2 + out.drives[k].rig % 2;
  return out;
}

absl::StatusOr<SparseViewAvatar> LearnParts(TrainingTakes& takes, const std::vector<Part>& parts,
                                            const SparseViewTraining& training, const std::stop_token& stop) {
  TrainingFrames frames;
  for (const Part& part : parts) {
    ClothTake& take = takes.take(part.take);
    frames.takes.push_back({take.name(), part.last - part.first, take.fps(), false, take.motion});
  }
  const TrainingFrames all = takes.Frames();
  frames.read = [&](int k, int frame) {
    const Part& part = parts[static_cast<size_t>(k)];
    return all.read(part.take, part.first + frame);
  };
  return LearnSparseView(takes.garment(), frames, training, {}, stop);
}

Rig RandomRig(const std::vector<Eigen::Vector3d>& vertices_mm, int cameras, uint64_t key) {
  StudioRigOptions options = SyntheticPreset("shirt-drive", 1)->rig;
  options.cameras = cameras;
  options.distance_mm = 1600 + 1400 * UniformOf(key, 1);
  options.around_variation_deg = 60.0 / options.cameras;
  options.elevation_deg = 20 * UniformOf(key, 2);
  options.elevation_variation_deg = 8;
  options.seed = MixBits(key);
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& v : vertices_mm) box.extend(v);
  options.aim_mm = box.center();
  Rig rig = *MakeStudioRig("random", options);
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(2 * std::numbers::pi * UniformOf(key, 3), Eigen::Vector3d::UnitY())
          .toRotationMatrix();
  for (CameraModel& camera : rig.cameras) {
    // The camera sees turned^-1 (x - aim) + aim.
    camera.translation_mm += camera.rotation * (box.center() - turn.transpose() * box.center());
    camera.rotation = camera.rotation * turn.transpose();
  }
  return rig;
}

class SampleMaker {
 public:
  SampleMaker(const NetSampleRequest& request, const Template& garment, Atlas atlas)
      : request_(request),
        garment_(garment),
        atlas_(std::move(atlas)),
        model_(garment),
        nodes_(garment),
        writer_(atlas_, kDrivingFeatures, kOffsets) {}

  std::string Head() const { return writer_.Head(); }

  absl::Status Run(const Drive& drive, ClothTake& take, const SparseViewAvatar& avatar,
                   const std::stop_token& stop, std::string* out) const {
    const TruthViews cloth(garment_, take.body);
    const DrivingFeatures features(model_, avatar);
    RayDriver driver(model_, avatar, {});
    const uint64_t key = KeyOf(request_.seed, absl::StrCat(take.name(), " ", drive.space, " ", drive.rig));
    std::optional<Rig> rig;
    for (int f = drive.first; f < drive.last; f += request_.every) {
      if (stop.stop_requested()) return absl::CancelledError("the making of samples was stopped");
      WEFT_ASSIGN_OR_RETURN(const ClothFrame truth, take.Read(f));
      if (!rig) rig = RandomRig(truth.vertices_mm, drive.cameras, key);
      WEFT_ASSIGN_OR_RETURN(const auto seen,
                            cloth.Observe(truth, *rig, key ^ MixBits(static_cast<uint64_t>(f))));
      WEFT_ASSIGN_OR_RETURN(const auto rays,
                            RaysOf(DrivingViewsOf(seen, *rig), nodes_, SparseViewOptions().cloth_sigma_px));
      WEFT_ASSIGN_OR_RETURN(const auto driven, driver.Drive(request_.every, rays));
      if (driven.track.lost || driven.track.started_anew || f < drive.first + 2 * request_.every) continue;
      const std::vector<Eigen::Matrix3f> axes = features.axes().RotationsOf(driven.position_mm);
      const AtlasImage input = atlas_.Gather(features.Of(driven, rays, axes), kDrivingFeatures);
      std::vector<float> offsets(axes.size() * kOffsets);
      for (size_t v = 0; v < axes.size(); ++v) {
        const Eigen::Vector3f off = axes[v].transpose() *
                                    (truth.vertices_mm[v] - driven.position_mm[v]).cast<float>() /
                                    kAnswerUnitMm;
        for (int k = 0; k < kOffsets; ++k) offsets[v * kOffsets + k] = off[k];
      }
      const AtlasImage answer = atlas_.Gather(offsets, kOffsets);
      writer_.Append({drive.split, static_cast<uint32_t>(drive.take), static_cast<uint32_t>(f),
                      static_cast<uint32_t>(rig->cameras.size())},
                     input, answer, out);
    }
    return absl::OkStatus();
  }

 private:
  const NetSampleRequest& request_;
  const Template& garment_;
  Atlas atlas_;
  AlignmentModel model_;
  NodeVertices nodes_;
  SampleWriter writer_;  // of the atlas above
};

}  // namespace

absl::Status MakeNetSamples(TrainingTakes& takes, const NetSampleRequest& request,
                            const std::function<void(std::string_view stage, double share)>& on_progress,
                            const std::stop_token& stop) {
  WEFT_ASSIGN_OR_RETURN(Atlas atlas,
                        Atlas::Build(takes.garment(), ChartsOnBoard(takes.garment()), request.atlas));
  const Plan plan = PlanOf(takes, request.rigs);
  if (plan.spaces.size() == 1)
    return absl::InvalidArgumentError(absl::StrCat("a net: ", FramesOf(plan.spaces[0]),
                                                   " frames to learn from are too few, at least ",
                                                   2 * kLeastLearnt, " are needed"));
  std::vector<std::unique_ptr<SparseViewAvatar>> avatars;
  for (const std::vector<Part>& parts : plan.spaces) {
    WEFT_ASSIGN_OR_RETURN(auto avatar, avatars.empty() ? LearnSparseView(takes.garment(), takes.Frames(),
                                                                         request.training, {}, stop)
                                                       : LearnParts(takes, parts, request.training, stop));
    avatars.push_back(std::make_unique<SparseViewAvatar>(std::move(avatar)));
    if (on_progress)
      on_progress("spaces", static_cast<double>(avatars.size()) / static_cast<double>(plan.spaces.size()));
  }
  const SampleMaker maker(request, takes.garment(), std::move(atlas));
  constexpr size_t kAtOnce = 4;
  return WriteSamples(
      request.out, maker.Head(), plan.drives.size(), kAtOnce,
      [&](size_t k, std::string* samples) {
        const Drive& drive = plan.drives[k];
        absl::StatusOr<ClothTake> take = takes.take(drive.take).OpenAgain();
        return take.ok() ? maker.Run(drive, *take, *avatars[drive.space], stop, samples) : take.status();
      },
      [&](double share) {
        if (on_progress) on_progress("samples", share);
      });
}

}  // namespace weft
