#include "services/animation/net_samples.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdio>
#include <fstream>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "animation/driving_features.h"
#include "animation/ray_driver.h"
#include "animation/sparse_view_driver.h"
#include "base/counter_random.h"
#include "services/animation/cloth_take.h"
#include "services/animation/truth_views.h"
#include "simulation/dataset_presets.h"
#include "simulation/studio_rig.h"
#include "simulation/take_presets.h"

namespace weft {
namespace {

constexpr int kOffsets = 3;

// A run of frames of a take that a space never saw.
struct Drive {
  int take = 0, first = 0, last = 0;
  size_t space = 0;
  uint32_t split = 0;  // 0 training, 1 validation, 2 validation of a class that training never shows
  int rig = 0, cameras = 2;
};

// What a space is learnt from: frames of takes.
struct Fold {
  std::vector<std::pair<int, std::pair<int, int>>> parts;  // take, first and last frame
};

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

// Sixteen-bit floats.
void AppendHalves(const float* values, size_t count, std::string* out) {
  for (size_t i = 0; i < count; ++i) {
    const Eigen::half half(values[i]);
    out->append(reinterpret_cast<const char*>(&half), sizeof(half));
  }
}
template <class T>
void Append(const T& value, std::string* out) {
  out->append(reinterpret_cast<const char*>(&value), sizeof(value));
}

class SampleMaker {
 public:
  SampleMaker(const NetSampleRequest& request, const Template& garment, Atlas atlas)
      : request_(request), garment_(garment), atlas_(std::move(atlas)), model_(garment), nodes_(garment) {
    for (size_t t = 0; t < atlas_.kinds().size(); ++t)
      if (atlas_.kinds()[t] != TexelKind::kEmpty) texels_.push_back(static_cast<int>(t));
  }

  std::string Head() const {
    std::string out = "weftsmp1";
    for (const int n :
         {kDrivingFeatures, kOffsets, atlas_.height(), atlas_.width(), static_cast<int>(texels_.size())})
      Append(static_cast<uint32_t>(n), &out);
    for (const int t : texels_) Append(static_cast<uint32_t>(t), &out);
    for (const int t : texels_) Append(static_cast<uint8_t>(atlas_.kinds()[t]), &out);
    return out;
  }

  absl::Status Run(const Drive& drive, ClothTake& take, const SparseViewAvatar& avatar,
                   std::string* out) const {
    const TruthViews cloth(garment_, take.body);
    const DrivingFeatures features(model_, avatar);
    RayDriver driver(model_, avatar, {});
    const uint64_t key = KeyOf(request_.seed, absl::StrCat(take.name(), " ", drive.space, " ", drive.rig));
    std::optional<Rig> rig;
    for (int f = drive.first; f < drive.last; f += request_.every) {
      const absl::StatusOr<ClothFrame> truth = take.Read(f);
      if (!truth.ok()) return truth.status();
      if (!rig) rig = RandomRig(truth->vertices_mm, drive.cameras, key);
      const auto seen = cloth.Look(*truth, *rig, key ^ MixBits(static_cast<uint64_t>(f)));
      if (!seen.ok()) return seen.status();
      std::vector<DrivingView> views;
      for (size_t c = 0; c < rig->cameras.size(); ++c)
        views.push_back({&rig->cameras[c], (*seen)[c].observations});
      const auto rays = RaysOf(views, nodes_, SparseViewOptions().cloth_sigma_px);
      if (!rays.ok()) return rays.status();
      const auto driven = driver.Drive(request_.every, *rays);
      if (!driven.ok()) return driven.status();
      if (driven->track.lost || driven->track.started_anew || f < drive.first + 2 * request_.every) continue;
      const std::vector<Eigen::Matrix3f> axes = features.axes().RotationsOf(driven->position_mm);
      const AtlasImage input = atlas_.Gather(features.Of(*driven, *rays, axes), kDrivingFeatures);
      std::vector<float> offsets(axes.size() * kOffsets);
      for (size_t v = 0; v < axes.size(); ++v) {
        const Eigen::Vector3f off = axes[v].transpose() *
                                    (truth->vertices_mm[v] - driven->position_mm[v]).cast<float>() /
                                    kAnswerUnitMm;
        for (int k = 0; k < kOffsets; ++k) offsets[v * kOffsets + k] = off[k];
      }
      const AtlasImage answer = atlas_.Gather(offsets, kOffsets);
      for (const uint32_t n : {drive.split, static_cast<uint32_t>(drive.take), static_cast<uint32_t>(f),
                               static_cast<uint32_t>(rig->cameras.size())})
        Append(n, out);
      AppendTexels(input, out);
      AppendTexels(answer, out);
    }
    return absl::OkStatus();
  }

 private:
  void AppendTexels(const AtlasImage& image, std::string* out) const {
    std::vector<float> row(texels_.size());
    for (int c = 0; c < image.channels; ++c) {
      for (size_t i = 0; i < texels_.size(); ++i)
        row[i] = image.values[static_cast<size_t>(c) * image.PlaneSize() + static_cast<size_t>(texels_[i])];
      AppendHalves(row.data(), row.size(), out);
    }
  }

  const NetSampleRequest& request_;
  const Template& garment_;
  Atlas atlas_;
  AlignmentModel model_;
  NodeVertices nodes_;
  std::vector<int> texels_;
};

}  // namespace

absl::Status MakeNetSamples(const NetSampleRequest& request,
                            const std::function<void(std::string_view stage, double share)>& on_progress,
                            const std::stop_token& stop) {
  std::vector<ClothSource> sources;
  for (const std::string& folder : request.sources) {
    absl::StatusOr<ClothSource> source = OpenClothSource(folder, 0);
    if (!source.ok()) return source.status();
    sources.push_back(*std::move(source));
  }
  const absl::StatusOr<SharedTemplate> garment = TemplateOfSources(sources, request.garment);
  if (!garment.ok()) return garment.status();
  absl::StatusOr<Atlas> atlas = Atlas::Build(garment->garment, request.atlas);
  if (!atlas.ok()) return atlas.status();
  std::vector<ClothTake*> takes;
  std::vector<bool> validates;
  for (ClothSource& source : sources)
    for (ClothTake& take : source.takes) {
      const bool is_validation = source.is_dataset && take.split == NameOf(DatasetSplit::kValidate);
      if (source.is_dataset && !is_validation && take.split != NameOf(DatasetSplit::kTrain)) continue;
      takes.push_back(&take);
      validates.push_back(is_validation);
    }
  const auto is_unseen = [&](int t) {
    return !request.unseen.empty() && takes[t]->name().find(request.unseen) != std::string::npos;
  };
  // Space 0 has all; 1 and 2 the halves; then one without each take.
  std::vector<Fold> folds(3);
  std::vector<Drive> drives;
  const int count = static_cast<int>(takes.size());
  for (int t = 0; t < count; ++t) {
    const int frames = takes[t]->frames(), half = frames / 2;
    if (validates[t]) {
      for (int rig = 0; rig < request.rigs; ++rig)
        if (!is_unseen(t)) drives.push_back({t, 0, frames, 0, 1, rig});
      continue;
    }
    folds[0].parts.push_back({t, {0, frames}});
    folds[1].parts.push_back({t, {0, half}});
    folds[2].parts.push_back({t, {half, frames}});
    Fold without;
    for (int other = 0; other < count; ++other)
      if (other != t && !validates[other]) without.parts.push_back({other, {0, takes[other]->frames()}});
    for (int rig = 0; rig < request.rigs; ++rig) {
      drives.push_back({t, 0, frames, folds.size(), is_unseen(t) ? 2u : 0u, rig});
      if (is_unseen(t)) continue;
      drives.push_back({t, half, frames, 1, 0, rig});
      drives.push_back({t, 0, half, 2, 0, rig});
    }
    folds.push_back(std::move(without));
  }
  // Two and three cameras in turn; four now and then, but to train.
  for (size_t k = 0; k < drives.size(); ++k)
    drives[k].cameras = drives[k].split == 0 && k % 7 == 6 ? 4 : 2 + drives[k].rig % 2;
  std::vector<std::unique_ptr<SparseViewAvatar>> avatars;
  for (size_t k = 0; k < folds.size(); ++k) {
    TrainingFrames frames;
    for (const auto& [take, range] : folds[k].parts)
      frames.takes.push_back({takes[take]->name(), range.second - range.first, takes[take]->fps(), false});
    frames.read = [&](int part, int frame) -> absl::StatusOr<std::vector<Eigen::Vector3d>> {
      const auto& [take, range] = folds[k].parts[part];
      absl::StatusOr<ClothFrame> cloth = takes[take]->Read(range.first + frame);
      if (!cloth.ok()) return cloth.status();
      return std::move(cloth->vertices_mm);
    };
    SparseViewTraining training = request.training;
    training.calibration_frames = 1;
    auto avatar = TrainSparseView(garment->garment, frames, training, {}, stop);
    if (!avatar.ok()) return avatar.status();
    avatars.push_back(std::make_unique<SparseViewAvatar>(*std::move(avatar)));
    if (on_progress) on_progress("spaces", static_cast<double>(k + 1) / static_cast<double>(folds.size()));
  }
  const SampleMaker maker(request, garment->garment, *std::move(atlas));
  const std::string draft = request.out + ".part";
  std::ofstream file(draft, std::ios::binary);
  const std::string head = maker.Head();
  file.write(head.data(), static_cast<std::streamsize>(head.size()));
  constexpr size_t kAtOnce = 4;
  for (size_t first = 0; first < drives.size(); first += kAtOnce) {
    const size_t some = std::min(kAtOnce, drives.size() - first);
    std::vector<std::string> records(some);
    std::vector<absl::Status> status(some);
    tbb::parallel_for(size_t{0}, some, [&](size_t k) {
      const Drive& drive = drives[first + k];
      absl::StatusOr<ClothTake> take = takes[drive.take]->OpenAgain();
      status[k] = take.ok() ? maker.Run(drive, *take, *avatars[drive.space], &records[k]) : take.status();
    });
    for (size_t k = 0; k < some; ++k) {
      if (!status[k].ok()) return status[k];
      file.write(records[k].data(), static_cast<std::streamsize>(records[k].size()));
    }
    if (stop.stop_requested()) return absl::CancelledError("the making of samples was stopped");
    if (on_progress)
      on_progress("samples", static_cast<double>(first + some) / static_cast<double>(drives.size()));
  }
  file.close();
  if (!file || std::rename(draft.c_str(), request.out.c_str()) != 0)
    return absl::UnavailableError(absl::StrCat(request.out, ": can't be written; is the disk full?"));
  return absl::OkStatus();
}

}  // namespace weft
