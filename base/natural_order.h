// The order of names with numbers in them.
#pragma once

#include <string_view>

namespace weft {

// Numbers inside names compare by value: image9 before image10.
bool NaturalLess(std::string_view a, std::string_view b);

struct NaturalOrder {
  bool operator()(std::string_view a, std::string_view b) const { return NaturalLess(a, b); }
};

}  // namespace weft
