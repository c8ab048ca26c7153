// What right takes may have: worse pictures, hidden cloth, a camera that was knocked.
#pragma once

#include <cstdint>
#include <vector>

#include "base/random.h"
#include "capture/rig/rig.h"
#include "triangulation/triangulate.h"

namespace weft {

// From 0 to 1.
double Uniform(Random& random);

// Observations as a worse decoder, worse pictures and other cloth would leave them.
struct Disturbance {
  double noise_px = 0, wrong_share = 0, kept_share = 1;
  int half_hidden = 0, half_seeing = 0;  // cameras
  double knock_deg = 0;                  // of one camera
};

// Changes the observations of all frames, and the rig where a camera is knocked.
void Disturb(const Disturbance& by, uint64_t seed, std::vector<std::vector<ViewObservations>>& frames,
             Rig& rig);

}  // namespace weft
