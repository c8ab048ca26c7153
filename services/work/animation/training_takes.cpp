#include "services/work/animation/training_takes.h"

#include <utility>

#include "base/status_macros.h"
#include "simulation/dataset_presets.h"

namespace weft {
namespace {

absl::StatusOr<std::vector<ClothSource>> OpenSources(const std::vector<std::string>& folders, double fps) {
  std::vector<ClothSource> out;
  for (const std::string& folder : folders) {
    WEFT_ASSIGN_OR_RETURN(ClothSource source, OpenClothSource(folder, fps));
    out.push_back(std::move(source));
  }
  return out;
}

}  // namespace

absl::StatusOr<TrainingTakes> TrainingTakes::Open(const std::vector<std::string>& sources,
                                                  const std::vector<std::string>& held_out,
                                                  const std::string& garment, double fps) {
  WEFT_ASSIGN_OR_RETURN(std::vector<ClothSource> learnt, OpenSources(sources, fps));
  WEFT_ASSIGN_OR_RETURN(std::vector<ClothSource> held, OpenSources(held_out, fps));
  WEFT_ASSIGN_OR_RETURN(SharedTemplate shared, TemplateOfSources(learnt, garment));
  WEFT_RETURN_IF_ERROR(TemplateOfSources(held, shared.path).status());
  TrainingTakes out;
  out.garment_ = std::move(shared.garment);
  const auto add = [&out](ClothTake& take, bool is_held_out) {
    out.takes_.push_back(std::move(take));
    out.held_out_.push_back(is_held_out);
  };
  for (ClothSource& source : learnt)
    for (ClothTake& take : source.takes) {
      const bool is_validation = source.is_dataset && take.split == NameOf(DatasetSplit::kValidate);
      if (!source.is_dataset || is_validation || take.split == NameOf(DatasetSplit::kTrain))
        add(take, is_validation);
    }
  for (ClothSource& source : held)
    for (ClothTake& take : source.takes)
      if (!source.is_dataset || take.split == NameOf(DatasetSplit::kValidate)) add(take, true);
  return out;
}

TrainingFrames TrainingTakes::Frames() {
  TrainingFrames out;
  for (int t = 0; t < size(); ++t)
    out.takes.push_back({take(t).name(), take(t).frames(), take(t).fps(), is_held_out(t), take(t).motion});
  out.read = [this](int t, int frame) -> absl::StatusOr<std::vector<Eigen::Vector3d>> {
    WEFT_ASSIGN_OR_RETURN(ClothFrame cloth, take(t).Read(frame));
    return std::move(cloth.vertices_mm);
  };
  return out;
}

}  // namespace weft
