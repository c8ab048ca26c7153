// Vector files drawn with cairo, in mm.
#pragma once

#include <cairo.h>

#include <functional>
#include <string>
#include <vector>

#include "absl/status/status.h"

namespace weft {

struct PageSize {
  double width_mm = 0, height_mm = 0;
};

// `draw` is given the page (from 0) and a context whose unit is the mm and whose origin is the page's upper
// left corner. Unavailable: the file cannot be written.
absl::Status WritePdf(const std::string& path, const std::string& title, const std::vector<PageSize>& pages,
                      const std::function<void(size_t, cairo_t*)>& draw);
absl::Status WriteSvg(const std::string& path, const PageSize& page,
                      const std::function<void(cairo_t*)>& draw);

}  // namespace weft
