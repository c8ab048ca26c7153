#include "capture/image/grey_levels.h"

#include <algorithm>
#include <numeric>

namespace weft {

int BitsInUse::Count() const {
  constexpr uint64_t kOneIn = 10'000;
  const uint64_t total = std::accumulate(counts_.begin(), counts_.end(), uint64_t{0});
  uint64_t above = 0;
  for (int bits = 16; bits > 8; --bits) {
    above += counts_[static_cast<size_t>(bits)];
    if (above * kOneIn > total) return bits;
  }
  return 8;
}

std::vector<uint8_t> ToEightBits(std::span<const uint16_t> values) {
  BitsInUse used;
  for (const uint16_t value : values) used.Add(value);
  const uint32_t white = (uint32_t{1} << used.Count()) - 1;
  std::vector<uint8_t> out(values.size());
  std::transform(values.begin(), values.end(), out.begin(), [white](uint16_t value) {
    return static_cast<uint8_t>((255 * std::min<uint32_t>(value, white) + white / 2) / white);
  });
  return out;
}

}  // namespace weft
