// The inner loops over whole images, row by row, compiled for several instruction sets. All give the same
// bytes. Pixels are red, green, blue and a spare byte.
#pragma once

#include <cstdint>
#include "simd/dispatch.h"

namespace weft {

// A row of a Bayer mosaic, with those beside it.
struct BayerRow {
  const uint8_t *above = nullptr, *here = nullptr, *below = nullptr;
  bool first_green = false;  // begins with green
  bool with_red = false;     // holds red beside green, else blue
};

// Two sets of symmetric taps, of offsets 0 to the reach. That of `wide` is no less.
struct SpotTaps {
  const float* narrow = nullptr;
  int narrow_reach = 0;
  const float* wide = nullptr;
  int reach = 0;
};

struct ImageKernels {
  // One row of a mosaic of at least 3x3 pixels, bilinear as ToRgb. OpenCV's gives the same bytes in five
  // times as long (benchmark_library, 10.9 Mpx: 27.8 against 5.4 ms).
  void (*demosaic_row)(const BayerRow& row, int width_px, uint8_t* rgbx);
  // Three bytes a pixel to four.
  void (*widen_row)(const uint8_t* rgb, int width_px, uint8_t* rgbx);
  // Means of 2x2 pixels. cv::resize gives the same bytes in 1.3 times as long (10.9 Mpx: 3.8 against 2.9 ms).
  void (*halve_rows)(const uint8_t* upper, const uint8_t* lower, int half_width_px, uint8_t* rgbx);
  // Logarithm of the brightest channel plus 10; the offset keeps noise in the dark small.
  void (*brightness_row)(const uint8_t* rgbx, int width_px, float* out);
  // One row of an image smoothed by the narrow taps minus that smoothed by the wide ones; rows[reach + k] is
  // the row at k. Pixels beyond the border repeat it. `scratch` holds 2 (width + 2 reach) floats. With
  // brightness_row it takes a sixth of the time of OpenCV's logarithm and blurs, which round otherwise
  // (10.9 Mpx: 23.5 against 144 ms).
  void (*spot_row)(const float* const* rows, const SpotTaps& taps, int width_px, float* scratch, float* out);
  // 1 where a pixel of rows[3] is above its eight neighbours and by `contrast` above the least of its 7x7
  // pixels, which are rows[0] to rows[6]; ties go to the first in reading order. The first and last pixel are
  // left out. `scratch` holds width + 6 floats.
  void (*peak_row)(const float* const* rows, float contrast, int width_px, float* scratch, uint8_t* peaks);
};

// The fastest that this processor runs.
const ImageKernels& BestImageKernels();

WEFT_DECLARE_BUILDS(ImageKernels, kImageKernels)

}  // namespace weft
