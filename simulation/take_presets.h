// Recordings with a name.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "simulation/synthetic_take.h"

namespace weft {

struct TakePreset {
  std::string name;
  std::string about;  // one line
};
std::vector<TakePreset> TakePresets();

// Every part's seed follows from `seed`. InvalidArgument lists the names there are.
absl::StatusOr<SyntheticTakeOptions> SyntheticPreset(std::string_view name, uint64_t seed);

}  // namespace weft
