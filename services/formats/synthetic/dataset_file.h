// dataset.json: what a set of takes holds and how it is made again; what its takes say about chaos.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "evaluation/error_summary.h"
#include "simulation/dataset_presets.h"
#include "weft/v1/dataset.pb.h"

namespace weft {

// <folder>/dataset.json, from the preset and from the takes that are complete by now. Errors of files.
absl::Status WriteDatasetFile(const DatasetPreset& preset, const std::string& folder);

// InvalidArgument names source_name and what is wrong: unknown fields, splits or motions, names that do not
// follow from them, and what CheckSplits refuses.
absl::StatusOr<v1::Dataset> ParseDataset(std::string_view json, const std::string& source_name);
// NotFound with the remedy where the folder holds no data set.
absl::StatusOr<v1::Dataset> ReadDatasetFile(const std::string& folder);

// DataLoss names the complete take whose frames.bin is not the one that was made, or has other vertices.
absl::Status CheckDatasetFrames(const v1::Dataset& dataset, const std::string& folder);

// evaluation/chaos_floor.h, of a take of the split chaos.
struct TakeFloor {
  std::string take;  // whose motion it repeats
  int frames = 0;    // that both takes have, after the first half second
  ErrorSummary distance_mm, normals_deg;
  double error_jitter_mm = 0;  // in the mean
};
// Of the takes of the set whose both runs are complete. Errors of files.
absl::StatusOr<std::vector<TakeFloor>> MeasureFloor(const v1::Dataset& dataset, const std::string& folder);

}  // namespace weft
