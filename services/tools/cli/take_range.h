// The options that choose a part of a take.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/take/take_view.h"

namespace weft {

struct TakeRange {
  std::string sets;
  std::vector<std::string> shifts;
};

// --frames (once --sets) and --shift.
void AddTakeRangeOptions(CLI::App& command, TakeRange& range);

// InvalidArgument names the option and what it should look like.
absl::StatusOr<TakeViewOptions> ParseTakeRange(const TakeRange& range);

}  // namespace weft
