// Random numbers by counter, and sequences that spread evenly.
#pragma once

#include "base/counter_random.h"  // IWYU pragma: export

namespace weft {

// Van der Corput's sequence: evenly spread over 0 to 1, however many are taken.
inline float RadicalInverse(int i) {
  float out = 0, digit = 0.5f;
  for (; i > 0; i >>= 1, digit *= 0.5f) out += digit * static_cast<float>(i & 1);
  return out;
}

}  // namespace weft
