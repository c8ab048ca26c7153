// Lengths of time and sizes that the tests of retention share.
#pragma once

#include <cstdint>

namespace weft {

inline constexpr int64_t kSecond_ns = 1'000'000'000, kMinute_ns = 60 * kSecond_ns, kHour_ns = 60 * kMinute_ns,
                         kDay_ns = 24 * kHour_ns;
inline constexpr uint64_t kGib = uint64_t{1} << 30;

}  // namespace weft
