// Pictures written out in tests.
#pragma once

#include <string>

namespace weft {

// With a line for each element.
inline std::string SvgLines(std::string svg) {
  for (size_t at = svg.find("><"); at != std::string::npos; at = svg.find("><", at)) svg.insert(at + 1, "\n");
  return svg;
}

}  // namespace weft
