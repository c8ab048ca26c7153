// The order of names with numbers in them.
#pragma once

#include <string_view>

namespace weft {

// Numbers inside names compare by value: image9 before image10, take1.9 before take1.10. Behind times since
// 1970 in seconds, of nine digits and more, fractions compare as such: 1623840123.45 before 1623840123.5.
bool NaturalLess(std::string_view a, std::string_view b);

struct NaturalOrder {
  bool operator()(std::string_view a, std::string_view b) const { return NaturalLess(a, b); }
};

}  // namespace weft
