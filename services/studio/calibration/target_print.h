// Boards of a target as pages for print.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "capture/calibration/target.h"

namespace weft {

// <stem>.pdf and <stem>.svg, one page at true scale, black on white: the tags, what the board is, and a line
// of 100 mm to check the print with. The page is as large as the board with 10 mm around it. Errors of
// TagBoard::Validate and of writing.
absl::Status WriteBoardPrint(const TagBoard& board, const std::string& stem);

}  // namespace weft
