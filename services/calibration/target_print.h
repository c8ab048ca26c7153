// Boards of a target as pages for print.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "capture/calibration/target.h"

namespace weft {

// One page at true scale, black on white: the tags, a frame to cut along, what the board is, and a line of
// 100 mm to check the print with. The page is as large as the board with 10 mm around it.
absl::StatusOr<std::string> BoardSvg(const TagBoard& board);
absl::StatusOr<std::string> BoardPdf(const TagBoard& board);

}  // namespace weft
