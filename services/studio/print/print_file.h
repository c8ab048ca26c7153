// Print files: PDF, SVG and TIFF in true mm.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "services/studio/print/print_layout.h"

namespace weft {

struct PrintFileOptions {
  double dpi = 300;  // of TIFF

  absl::Status Validate() const;
};

// By the ending of `path`: .pdf holds all pages; .svg and .tif are a file per page, with "-2", "-3" ...
// before the ending from the second on. Answers the files written. InvalidArgument: another ending, a TIFF
// page of more than 32,767 pixels a side (the message says which resolution fits). `progress` hears of each
// page that is done.
absl::StatusOr<std::vector<std::string>> WritePrintFiles(
    const Board& board, const PrintLayout& layout, const std::string& path, const PrintFileOptions& options,
    const std::function<void(size_t)>& progress = nullptr);

}  // namespace weft
