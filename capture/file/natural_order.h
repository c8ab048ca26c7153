// The order of names with numbers in them.
#pragma once

#include <string>

namespace weft {

// Numbers inside names compare by value: image9 before image10.
bool NaturalLess(const std::string& a, const std::string& b);

struct NaturalOrder {
  bool operator()(const std::string& a, const std::string& b) const { return NaturalLess(a, b); }
};

}  // namespace weft
