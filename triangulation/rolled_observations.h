// Observations of a camera that looked a little before or after the others, brought to their moment.
#pragma once

#include <vector>

#include "pattern/observation.h"

namespace weft {

// Of one view, and when it was seen against the moment that is wanted.
struct SeenAt {
  double time_s = 0;
  std::vector<Observation> observations;
};

// Positions at time 0, which lies between `own.time_s` and `other.time_s`, from two consecutive frames of one
// camera: linear for nodes that both show. A node that `own` alone shows moves as at least 3 nodes within 2
// cells of it do in the mean, and their spread counts as an error; without these it is left out. `other` is
// only used for its motion. Sigmas follow from those of both frames; acceleration is not in them: it moves a
// node by at most a eighth of its value times the square of the frames' distance. Order and identity of `own`
// stay.
std::vector<Observation> RollToMoment(const SeenAt& own, const SeenAt& other);

}  // namespace weft
