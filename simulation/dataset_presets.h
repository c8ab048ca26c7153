// Sets of takes without pictures, for training and testing what predicts cloth.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "figure/motion_generator.h"
#include "simulation/synthetic_take.h"

namespace weft {

// Known: of the classes that are trained on, with other seeds. Unseen: of classes that training never shows.
// Chaos: a take of another split once more, its time step shorter by a tenth; no method that knows the motion
// alone comes nearer.
enum class DatasetSplit { kTrain, kValidate, kTestKnown, kTestUnseen, kChaos };
std::string_view NameOf(DatasetSplit split);  // "train", "validate", "test-known", "test-unseen", "chaos"

struct DatasetTake {
  DatasetSplit split = DatasetSplit::kTrain;
  MotionKind motion = MotionKind::kStanding;
  uint64_t seed = 0;  // of the motion
  int frames = 0;

  // "train-walk-104", unique in its set.
  std::string Name() const;
};

struct DatasetPreset {
  std::string_view name;
  std::string_view about;
  double cell_mm = 0;
  std::vector<DatasetTake> takes;  // those that are to be made first come first
};

std::vector<DatasetPreset> DatasetPresets();
// InvalidArgument lists the names there are.
absl::StatusOr<DatasetPreset> DatasetPresetNamed(std::string_view name);

// What all takes of a set share: garment, board, fabric, body. Without a motion.
absl::StatusOr<SyntheticTakeOptions> DatasetTakeBase(const DatasetPreset& preset);
// The options of one take; errors of MakeMotion.
absl::StatusOr<SyntheticTakeOptions> OptionsOf(const DatasetPreset& preset, const DatasetTake& take);

// InvalidArgument when a test or the validation shares a motion (kind and seed) with training, when an unseen
// class is trained or chosen on, or when chaos repeats no take.
absl::Status CheckSplits(std::span<const DatasetTake> takes);

}  // namespace weft
