// Random numbers by counter: the value depends on the key only, never on the order of calls.
#pragma once

#include <cmath>
#include <cstdint>
#include <string_view>

#include "base/random.h"

namespace weft {

// A key from a seed and what it is used for, so that two uses of one seed are independent.
inline uint64_t KeyOf(uint64_t seed, std::string_view use) {
  uint64_t key = MixBits(seed);
  for (const char c : use) key = MixBits(key ^ static_cast<uint8_t>(c));
  return key;
}

// Uniform in (0, 1).
inline double UniformOf(uint64_t key, uint64_t counter) {
  return (static_cast<double>(MixBits(key ^ MixBits(counter)) >> 11) + 0.5) * 0x1.0p-53;
}

// Standard normal (Box and Muller).
inline double NormalOf(uint64_t key, uint64_t counter) {
  const double u = UniformOf(key, 2 * counter), v = UniformOf(key, 2 * counter + 1);
  return std::sqrt(-2 * std::log(u)) * std::cos(6.283185307179586 * v);
}

}  // namespace weft
