// How many grey levels a picture uses, and how coarse they are.
#pragma once

#include "capture/image/frame.h"

namespace weft {

// Dark pictures are made brighter before they are measured: means of pixels, on which the decoder works, then
// are not rounded to their few levels once more.
struct Exposure {
  int gain = 1;  // by which values are multiplied; above 1 where hardly any value reaches half of white
  // Between values that the camera tells apart, in grey levels after the gain. Above `gain` where a program
  // stretched fewer levels to the whole range.
  float step = 1;
};

// From some rows. Precondition: the frame is valid.
Exposure MeasureExposure(const Frame& frame);

// The frame with its values multiplied, at most white.
Frame Brightened(const Frame& frame, int gain);

}  // namespace weft
