// Random numbers that are the same on every platform, unlike those of the standard library's distributions.
#pragma once

#include <cstdint>

namespace weft {

// A bijective mix of 64 bits (the step and the finalizer of SplitMix64, Steele, Lea, Flood 2014).
inline uint64_t MixBits(uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

// SplitMix64: a small generator whose state is one word.
class Random {
 public:
  explicit Random(uint64_t seed) : state_(seed) {}

  uint64_t Next() {
    const uint64_t out = MixBits(state_);
    state_ += 0x9e3779b97f4a7c15ULL;
    return out;
  }

  // 0 to n - 1.
  uint32_t Below(uint32_t n) {
    return static_cast<uint32_t>((static_cast<unsigned __int128>(Next()) * n) >> 64);
  }

 private:
  uint64_t state_;
};

}  // namespace weft
