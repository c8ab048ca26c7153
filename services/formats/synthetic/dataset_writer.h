// Sets of takes on disk (simulation/dataset_presets.h).
#pragma once

#include <functional>
#include <stop_token>
#include <string>

#include "absl/status/statusor.h"
#include "simulation/dataset_presets.h"

namespace weft {

struct DatasetSummary {
  int takes = 0;         // of the set
  int complete = 0;      // of them, by now
  int elsewhere = 0;     // that another process works on
  int frames = 0;        // of the complete ones
  bool is_late = false;  // the time that was given is over
};

// Makes what is missing of the set below `out`: takes.csv, dressed/ (the garment put on, once for all), a
// take without pictures for each in takes/<name>, and dataset.json (dataset_file.h) at the end of each call.
// Several processes may work on one set, each on a take of its own. Stops between two frames after `minutes`
// (0: never) or when `stop` is requested, and goes on there at the next call; the bytes do not depend on
// that. `on_frame` (may be empty) is called with a take's name, its finished frames and all of its frames.
// Errors of WriteClothTake; Internal names the first take whose simulation broke down, after the others were
// made. Unavailable while another process puts
// the garment on.
absl::StatusOr<DatasetSummary> MakeDataset(
    const DatasetPreset& preset, const std::string& out, double minutes,
    const std::function<void(const std::string& take, int done, int frames)>& on_frame = {},
    const std::stop_token& stop = {});

}  // namespace weft
