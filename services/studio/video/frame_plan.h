// Which frame of each video belongs to which frame set.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace weft {

struct FramePlan {
  size_t reference = 0;             // the camera whose frames make the sets where it films
  std::vector<double> set_times_s;  // rising
  // [camera][set]: the frame of its video that is nearest to the set, -1 where none is within half a period.
  std::vector<std::vector<int64_t>> frames;
  // By camera: frames that are in no set, since another one is nearer to each.
  std::vector<uint64_t> left_out;
};

// `times_s`: of each camera's frames, rising, on one axis for all. Sets are the frames of the slowest camera
// and, where it does not film, moments a multiple of its period away at which another camera does: so clips
// of any length are in the plan as a whole. Empty where no camera has a frame.
FramePlan PlanFrames(const std::vector<std::vector<double>>& times_s);

}  // namespace weft
