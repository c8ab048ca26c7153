// The order of names with numbers in them.
#pragma once

#include <cstddef>
#include <string_view>

namespace weft {

// So many digits before a point, and more, are a time in seconds since 1970, no version.
inline constexpr size_t kDigitsOfTime = 9;

// Numbers inside names compare by value: image9 before image10, take1.9 before take1.10. Fractions
// of times compare as such: 1623840123.45 before 1623840123.5.
bool NaturalLess(std::string_view a, std::string_view b);

struct NaturalOrder {
  bool operator()(std::string_view a, std::string_view b) const { return NaturalLess(a, b); }
};

}  // namespace weft
