// Images as the decoder works on them.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/image/frame.h"
#include "pattern/image/pixel_allocator.h"

namespace weft {

// Red, green, blue and a spare byte per pixel, [height][width][4].
struct ColorImage {
  int width_px = 0;
  int height_px = 0;
  PixelVector<uint8_t> rgbx;

  uint8_t* row(int y) { return rgbx.data() + 4 * static_cast<size_t>(y) * width_px; }
  const uint8_t* at(int x, int y) const { return rgbx.data() + 4 * (static_cast<size_t>(y) * width_px + x); }
};

// One float per pixel, [height][width].
struct Plane {
  int width_px = 0;
  int height_px = 0;
  PixelVector<float> values;

  const float* row(int y) const { return values.data() + static_cast<size_t>(y) * width_px; }
  float* row(int y) { return values.data() + static_cast<size_t>(y) * width_px; }
  // Bilinear; coordinates are clamped to the image.
  float Sample(float x, float y) const {
    const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
    if (!(x >= 0 && y >= 0 && x0 + 1 < width_px && y0 + 1 < height_px)) return SampleAtBorder(x, y);
    return Between(row(y0) + x0, row(y0 + 1) + x0, 1, x - static_cast<float>(x0), y - static_cast<float>(y0));
  }

 private:
  static float Between(const float* upper, const float* lower, int step, float fx, float fy) {
    return (1 - fy) * ((1 - fx) * upper[0] + fx * upper[step]) +
           fy * ((1 - fx) * lower[0] + fx * lower[step]);
  }
  float SampleAtBorder(float x, float y) const;
};

// The colours of a frame as ToRgb gives them; InvalidArgument as there.
absl::StatusOr<ColorImage> ToColorImage(const Frame& frame);

// Half the size, each pixel the mean of 2x2. Pixel x of the half image is at 2 x + 0.5 of `image`.
ColorImage HalfSize(const ColorImage& image);

// A cell is measured in the largest of an image and its halvings in which its shorter edge is below 7.5 px:
// the number of halvings, at most `levels` - 1, for an edge in px of the full image.
int PyramidLevelFor(float edge_px, size_t levels);

// Blur of bilinear samples of the image after halvings by `scale` in all, in px of the full image, which has
// a blur of `sigma_px` itself.
float SigmaInPyramid(float sigma_px, float scale);

// How much brighter than its surroundings a pixel is, as a ratio's logarithm: the brightest of the three
// channels (every ink line is dark in it and no colour), smoothed by sigma 0.5 px, over the same smoothed by
// `surround_px`; Gaussians end at 2.5 sigma, rounded to pixels.
Plane BlobContrast(const ColorImage& image, float surround_px);

}  // namespace weft
