// Random numbers of searches: the same on every platform.
#pragma once

#include <cstdint>

namespace weft {

// SplitMix64 (Steele, Lea, Flood 2014).
class Random {
 public:
  explicit Random(uint64_t seed) : state_(seed) {}

  // 0 to n - 1.
  uint32_t Below(uint32_t n) {
    uint64_t z = (state_ += 0x9e3779b97f4a7c15ULL);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return static_cast<uint32_t>((static_cast<unsigned __int128>(z ^ (z >> 31)) * n) >> 64);
  }

 private:
  uint64_t state_;
};

}  // namespace weft
