// Cameras that see the same board at the same moment.
#pragma once

#include <vector>

#include "capture/calibration/board_view.h"

namespace weft {

struct Covisibility {
  std::vector<std::vector<int>>
      shared;  // [cameras][cameras] boards at one moment that both see; own views on the diagonal
  std::vector<std::vector<int>> groups;  // connected components of the cameras; largest first
};

Covisibility CountSharedViews(const CalibrationViews& views);

// Views of each camera that another camera has as well, [cameras].
std::vector<int> SharedViews(const CalibrationViews& views);

}  // namespace weft
