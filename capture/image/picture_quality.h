// How well an image is exposed and focused, as a photographer's meter tells it.
#pragma once

#include "capture/image/frame.h"

namespace weft {

struct PictureQuality {
  double clipped_share = 0;  // of all values: 254 or 255, lost in white
  double dark_share = 0;     // 4 or less
  int low = 0;               // percentiles 1, 50 and 99 of the values
  int middle = 0;
  int high = 0;
  // Mean square of differences two pixels apart, along and across, over the mean square of the values: the
  // focus function of Brenner et al. (1976), made independent of the exposure. Two pixels apart a Bayer
  // mosaic has the same colour. Compares images of one camera and scene only: the sharpest has the most.
  double focus = 0;
};

// Large images are sampled: a million pixels at most are looked at. Precondition: the frame is valid.
PictureQuality MeasurePicture(const Frame& frame);

}  // namespace weft
