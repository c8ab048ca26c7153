#include "capture/image/picture_quality.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace weft {
namespace {

constexpr int kMostPixels = 1'000'000;
constexpr int kWhite = 254, kBlack = 4;

int Percentile(const std::array<uint64_t, 256>& histogram, uint64_t total, double share) {
  const auto wanted = static_cast<uint64_t>(share * static_cast<double>(total));
  uint64_t sum = 0;
  for (int value = 0; value < 256; ++value)
    if ((sum += histogram[static_cast<size_t>(value)]) > wanted) return value;
  return 255;
}

}  // namespace

PictureQuality MeasurePicture(const Frame& frame) {
  const int channels = BytesPerPixel(frame.format);
  const int values = frame.width_px * channels, apart = 2 * channels;
  const int step = std::max(1, static_cast<int>(int64_t{frame.width_px} * frame.height_px / kMostPixels));
  std::array<uint64_t, 256> histogram{};
  uint64_t total = 0, pairs = 0;
  double squares = 0, differences = 0;
  // Whole rows; a step that is odd, so that both kinds of a mosaic's rows are met.
  for (int y = 0; y < frame.height_px; y += step | 1) {
    const uint8_t* row = frame.row(y);
    const uint8_t* below = y + 2 < frame.height_px ? frame.row(y + 2) : nullptr;
    uint64_t row_squares = 0, row_differences = 0;
    for (int x = 0; x < values; ++x) {
      ++histogram[row[x]];
      row_squares += static_cast<uint64_t>(row[x]) * row[x];
      if (below == nullptr || x + apart >= values) continue;
      const int along = row[x + apart] - row[x], across = below[x] - row[x];
      row_differences += static_cast<uint64_t>(along * along + across * across);
    }
    total += static_cast<uint64_t>(values);
    if (below != nullptr && values > apart) pairs += static_cast<uint64_t>(values - apart);
    squares += static_cast<double>(row_squares);
    differences += static_cast<double>(row_differences);
  }
  PictureQuality quality;
  uint64_t clipped = 0, dark = 0;
  for (size_t value = 0; value < 256; ++value) {
    if (value >= kWhite) clipped += histogram[value];
    if (value <= kBlack) dark += histogram[value];
  }
  quality.clipped_share = static_cast<double>(clipped) / static_cast<double>(total);
  quality.dark_share = static_cast<double>(dark) / static_cast<double>(total);
  quality.low = Percentile(histogram, total, 0.01);
  quality.middle = Percentile(histogram, total, 0.5);
  quality.high = Percentile(histogram, total, 0.99);
  if (pairs > 0 && squares > 0)
    quality.focus = differences / static_cast<double>(pairs) / (squares / static_cast<double>(total));
  return quality;
}

}  // namespace weft
