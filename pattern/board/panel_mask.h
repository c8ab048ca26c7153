// The panels of a garment on its board.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/image/frame.h"

namespace weft {

// Labels of the cells, [rows][cols], 0 outside of all panels. The image has one pixel per cell, black
// outside. Pixels of one colour or grey are one panel; where there is but one besides black, its connected
// pieces are the panels, numbered in reading order. Panels of less than 9 cells hold no window and are left
// out. InvalidArgument: no panel, more than 255, a mosaic.
absl::StatusOr<std::vector<uint8_t>> PanelsFromMask(const Frame& mask);

// The panels as a grey image, one pixel per cell, the label as its value.
Frame PanelsToMask(const std::vector<uint8_t>& panels, int rows, int cols);

}  // namespace weft
