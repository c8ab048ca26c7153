#include "simulation/dataset_presets.h"

#include <algorithm>
#include <array>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "base/nearest_word.h"
#include "base/status_macros.h"
#include "simulation/take_presets.h"
#include "simulation/worn_garment.h"

namespace weft {
namespace {

constexpr std::array kKnownMotions = {MotionKind::kStanding, MotionKind::kTwist, MotionKind::kJogging,
                                      MotionKind::kWalk,     MotionKind::kWave,  MotionKind::kSpline,
                                      MotionKind::kMixed};
// Never trained on and never chosen on; so since before the first training.
constexpr std::array kUnseenMotions = {MotionKind::kSquat, MotionKind::kReach};

// Seeds say what they are for: 1xx training, 2xx validation, 3xx known tests, 4xx unseen tests.
std::vector<DatasetTake> DriveTakes(int train, int validate, int known, int unseen) {
  std::vector<DatasetTake> out;
  uint64_t k = 0;
  for (const MotionKind kind : kKnownMotions) out.push_back({DatasetSplit::kTrain, kind, 101 + k++, train});
  k = 0;
  for (const MotionKind kind :
       {MotionKind::kTwist, MotionKind::kWalk, MotionKind::kSpline, MotionKind::kMixed, MotionKind::kWave})
    out.push_back({DatasetSplit::kValidate, kind, 201 + k++, validate});
  k = 0;
  for (const MotionKind kind : kUnseenMotions)
    out.push_back({DatasetSplit::kTestUnseen, kind, 401 + k++, unseen});
  k = 0;
  for (const MotionKind kind : {MotionKind::kTwist, MotionKind::kJogging, MotionKind::kWalk,
                                MotionKind::kWave, MotionKind::kSpline, MotionKind::kMixed})
    out.push_back({DatasetSplit::kTestKnown, kind, 301 + k++, known});
  // The first two tests of known classes, and the first of an unseen one.
  out.push_back({DatasetSplit::kChaos, MotionKind::kTwist, 301, known});
  out.push_back({DatasetSplit::kChaos, MotionKind::kJogging, 302, known});
  out.push_back({DatasetSplit::kChaos, MotionKind::kSquat, 401, known});
  return out;
}

}  // namespace

std::string_view NameOf(DatasetSplit split) {
  constexpr std::array<std::string_view, 5> names = {"train", "validate", "test-known", "test-unseen",
                                                     "chaos"};
  return names[static_cast<size_t>(split)];
}

std::string DatasetTake::Name() const {
  return absl::StrCat(std::string(NameOf(split)), "-", std::string(NameOf(motion)), "-", seed);
}

std::vector<DatasetPreset> DatasetPresets() {
  return {{"shirt-drive",
           "a T-shirt of 19,000 cells of 6 mm: 3,500 frames of seven motions to train, 1,200 of other seeds "
           "and of two unseen motions to test; about 3 core-hours",
           6, DriveTakes(500, 50, 50, 250)},
          {"shirt-drive-12", "the same of a T-shirt of 4,800 cells; about 40 minutes of one core", 12,
           DriveTakes(500, 50, 50, 250)},
          {"tiny-drive", "the same of a T-shirt of 1,900 cells, 360 frames in all; minutes", 20,
           DriveTakes(20, 10, 10, 20)}};
}

absl::StatusOr<DatasetPreset> DatasetPresetNamed(std::string_view name) {
  std::vector<std::string> names;
  for (DatasetPreset& preset : DatasetPresets()) {
    if (preset.name == name) return std::move(preset);
    names.emplace_back(preset.name);
  }
  return absl::InvalidArgumentError(absl::StrCat("data set \"", std::string(name), "\" is none of ",
                                                 absl::StrJoin(names, ", "), DidYouMean(name, names)));
}

absl::StatusOr<SyntheticTakeOptions> DatasetTakeBase(const DatasetPreset& preset) {
  WEFT_ASSIGN_OR_RETURN(SyntheticTakeOptions out, SyntheticPreset("shirt-drive", 1));
  out.name = std::string(preset.name);
  out.performance.cell_mm = preset.cell_mm;
  return out;
}

absl::StatusOr<SyntheticTakeOptions> OptionsOf(const DatasetPreset& preset, const DatasetTake& take) {
  WEFT_ASSIGN_OR_RETURN(SyntheticTakeOptions out, DatasetTakeBase(preset));
  PerformanceOptions& performance = out.performance;
  performance.frames = take.frames;
  WEFT_ASSIGN_OR_RETURN(
      Motion motion,
      MakeMotion({take.motion, static_cast<double>(take.frames) / performance.fps + 1, 60, take.seed}));
  performance.clip = std::make_shared<const Motion>(std::move(motion));
  if (take.split == DatasetSplit::kChaos) performance.step_s = 0.9 * AutomaticStepS(performance);
  return out;
}

absl::Status CheckSplits(std::span<const DatasetTake> takes) {
  const auto bad = [](const DatasetTake& take, const std::string& what) {
    return absl::InvalidArgumentError(absl::StrCat("data set: ", take.Name(), " ", what));
  };
  const auto is_chosen_on = [](const DatasetTake& take) {
    return take.split == DatasetSplit::kTrain || take.split == DatasetSplit::kValidate;
  };
  for (const DatasetTake& take : takes) {
    for (const DatasetTake& other : takes) {
      if (&take == &other) continue;
      const bool same_motion = take.motion == other.motion && take.seed == other.seed;
      if (take.split == other.split && same_motion) return bad(take, "is there twice");
      if (take.split == DatasetSplit::kChaos || other.split == DatasetSplit::kChaos) continue;
      if (same_motion) return bad(take, absl::StrCat("has the motion of ", other.Name()));
      if (take.split == DatasetSplit::kTestUnseen && is_chosen_on(other) && take.motion == other.motion)
        return bad(take, absl::StrCat("is of a class that ", other.Name(), " shows"));
    }
    if (take.split != DatasetSplit::kChaos) continue;
    const bool repeats = std::any_of(takes.begin(), takes.end(), [&](const DatasetTake& other) {
      return other.split != DatasetSplit::kChaos && other.motion == take.motion && other.seed == take.seed &&
             other.frames >= take.frames;
    });
    if (!repeats) return bad(take, "repeats no take of the set");
  }
  return absl::OkStatus();
}

}  // namespace weft
