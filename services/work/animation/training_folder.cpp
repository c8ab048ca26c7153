#include "services/work/animation/training_folder.h"

#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/work/animation/avatar_folder.h"
#include "services/work/animation/net_sample.h"

namespace weft {
namespace {

std::string PathInTraining(const std::string& folder, const char* file) {
  return (std::filesystem::path(folder) / file).string();
}

}  // namespace

std::string TrainingFolderOf(const std::string& avatar) {
  std::filesystem::path place = std::filesystem::path(avatar).lexically_normal();
  if (!place.has_filename()) place = place.parent_path();
  return place.string() + ".training";
}

absl::StatusOr<v1::Avatar> DescribeSources(TrainingTakes& takes) {
  v1::Avatar about;
  about.set_template_id(takes.garment().id);
  for (int t = 0; t < takes.size(); ++t) {
    const ClothTake& take = takes.take(t);
    WEFT_ASSIGN_OR_RETURN(std::string hash, take.FramesHash());
    v1::AvatarSource& to = *about.add_sources();
    to.set_name(take.name());
    to.set_frames(take.frames());
    to.set_held_out(takes.is_held_out(t));
    to.set_motion(take.motion);
    to.set_frames_hash(std::move(hash));
  }
  return about;
}

std::string SourceLines(const v1::Avatar& about) {
  std::string out;
  for (const v1::AvatarSource& source : about.sources())
    absl::StrAppend(&out, source.held_out() ? "held out " : "source ", source.frames(), " ", source.motion(),
                    " ", source.frames_hash(), " ", source.name(), "\n");
  return out;
}

absl::Status BeginTrainingFolder(const std::string& folder, const std::string& recipe) {
  const std::string path = PathInTraining(folder, kRecipeFile);
  const absl::StatusOr<std::string> stands = ReadWholeFile(path);
  if (stands.ok() && *stands == recipe) return absl::OkStatus();
  if (std::error_code error;
      stands.ok() || (std::filesystem::exists(folder, error) && !std::filesystem::is_empty(folder, error)))
    return absl::FailedPreconditionError(
        absl::StrCat(folder, ": is of a training with other sources or options (", kRecipeFile,
                     "); give those to go on with it, or remove the folder to begin anew"));
  absl::Status status = CreateFolders(folder);
  return status.ok() ? WriteFileAtomically(path, recipe) : status;
}

absl::StatusOr<AvatarNet> ReadTrainedNet(const std::string& folder, const AtlasOptions& atlas,
                                         v1::AvatarNetTraining* training) {
  const auto path = [&](const char* name) { return PathInTraining(folder, name); };
  WEFT_RETURN_IF_ERROR(ReadJsonFile(path(kTrainingFile), *training));
  AvatarNet out;
  out.atlas = atlas;
  WEFT_ASSIGN_OR_RETURN(out.onnx, ReadWholeFile(path(kAvatarNetFile)));
  WEFT_ASSIGN_OR_RETURN(const std::string sample, ReadWholeFile(path(kAvatarSampleFile)));
  WEFT_RETURN_IF_ERROR(DecodeNetSample(sample, path(kAvatarSampleFile), &out));
  return out;
}

}  // namespace weft
