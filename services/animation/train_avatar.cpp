#include "services/animation/train_avatar.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "services/animation/cloth_take.h"
#include "simulation/dataset_presets.h"

namespace weft {
namespace {

struct LearntTake {
  ClothTake* take;
  bool held_out;
};

// Which takes of the sources are learnt from, or held out.
std::vector<LearntTake> ChooseTakes(std::vector<ClothSource>& sources, bool held_out) {
  std::vector<LearntTake> out;
  for (ClothSource& source : sources)
    for (ClothTake& take : source.takes) {
      const bool is_train = !source.is_dataset || take.split == NameOf(DatasetSplit::kTrain);
      const bool is_validation = source.is_dataset && take.split == NameOf(DatasetSplit::kValidate);
      if (held_out ? is_validation || !source.is_dataset : is_train || is_validation)
        out.push_back({&take, held_out || is_validation});
    }
  return out;
}

absl::StatusOr<std::vector<ClothSource>> OpenSources(const std::vector<std::string>& folders, double fps) {
  std::vector<ClothSource> out;
  for (const std::string& folder : folders) {
    absl::StatusOr<ClothSource> source = OpenClothSource(folder, fps);
    if (!source.ok()) return source.status();
    out.push_back(*std::move(source));
  }
  return out;
}

absl::StatusOr<v1::Avatar> AboutOf(const std::vector<LearntTake>& takes, const Template& garment) {
  v1::Avatar about;
  about.set_template_id(garment.id);
  for (const auto& [take, held_out] : takes) {
    absl::StatusOr<std::string> hash = take->FramesHash();
    if (!hash.ok()) return hash.status();
    v1::AvatarSource& to = *about.add_sources();
    to.set_name(take->name());
    to.set_frames(take->frames());
    to.set_held_out(held_out);
    to.set_motion(take->motion);
    to.set_frames_hash(*std::move(hash));
  }
  return about;
}

}  // namespace

absl::StatusOr<AvatarFile> TrainAvatar(
    const AvatarRequest& request,
    const std::function<void(std::string_view stage, double share)>& on_progress,
    const std::stop_token& stop) {
  if (absl::Status status = request.training.Validate(); !status.ok()) return status;
  if (absl::Status status = CheckAvatarPlace(request.out); !status.ok()) return status;
  absl::StatusOr<std::vector<ClothSource>> sources = OpenSources(request.sources, request.fps);
  if (!sources.ok()) return sources.status();
  absl::StatusOr<std::vector<ClothSource>> held_out = OpenSources(request.held_out, request.fps);
  if (!held_out.ok()) return held_out.status();
  const absl::StatusOr<SharedTemplate> garment = TemplateOfSources(*sources, request.garment);
  if (!garment.ok()) return garment.status();
  if (absl::Status status = TemplateOfSources(*held_out, garment->path).status(); !status.ok()) return status;

  std::vector<LearntTake> takes = ChooseTakes(*sources, false);
  for (const LearntTake& take : ChooseTakes(*held_out, true)) takes.push_back(take);
  absl::StatusOr<v1::Avatar> about = AboutOf(takes, garment->garment);
  if (!about.ok()) return about.status();
  TrainingFrames frames;
  for (const auto& [take, is_held_out] : takes)
    frames.takes.push_back({take->name(), take->frames(), take->fps(), is_held_out, take->motion});
  frames.read = [&takes](int take, int frame) -> absl::StatusOr<std::vector<Eigen::Vector3d>> {
    absl::StatusOr<ClothFrame> cloth = takes[static_cast<size_t>(take)].take->Read(frame);
    if (!cloth.ok()) return cloth.status();
    return std::move(cloth->vertices_mm);
  };
  const absl::StatusOr<SparseViewAvatar> avatar =
      TrainSparseView(garment->garment, frames, request.training, on_progress, stop);
  if (!avatar.ok()) return avatar.status();
  if (stop.stop_requested()) return absl::CancelledError("the training was stopped");
  if (absl::Status status = WriteAvatar(request.out, *std::move(about), *avatar); !status.ok()) return status;
  return ReadAvatar(request.out);
}

}  // namespace weft
