// The smallest synthetic take, for tests of those who write or read one.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <utility>

#include "simulation/synthetic_take.h"
#include "simulation/take_presets.h"

namespace weft {

inline SyntheticTakeOptions TinyOptions(uint64_t seed, int frames, int cameras) {
  SyntheticTakeOptions options = *SyntheticPreset("tiny", seed);
  options.performance.frames = frames;
  options.performance.step_s = 1.0 / 1000;  // stretches a little more, takes a tenth of the time
  options.rig.cameras = cameras;
  return options;
}

inline SyntheticTake Tiny(uint64_t seed, int frames, int cameras) {
  absl::StatusOr<SyntheticTake> take = SyntheticTake::Make(TinyOptions(seed, frames, cameras));
  EXPECT_TRUE(take.ok()) << take.status();
  return *std::move(take);
}

}  // namespace weft
