// Pictures as SVG files of their own.
#pragma once

#include <string>

namespace weft {

// A picture of `width` by `height` around `body`, on white, with the classes of plots in the colours for
// paper. `title` is shown above it and is not escaped yet. Loads nothing.
std::string SvgFile(double width, double height, const std::string& title, const std::string& body);

}  // namespace weft
