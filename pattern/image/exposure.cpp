#include "pattern/image/exposure.h"

#include <algorithm>
#include <array>
#include <memory>
#include <numeric>
#include <utility>
#include <vector>

namespace weft {
namespace {

// Rows of a picture that are looked at.
constexpr int kRows = 48;
constexpr int kWhite = 255;

using Histogram = std::array<uint32_t, 256>;

// Of each colour: of the channels, or of the places of a mosaic.
std::array<Histogram, 4> CountLevels(const Frame& frame) {
  std::array<Histogram, 4> counts{};
  const int step = std::max(1, frame.height_px / kRows) | 1;  // odd: both kinds of a mosaic's rows
  for (int y = 0; y < frame.height_px; y += step) {
    const uint8_t* row = frame.row(y);
    const size_t first = frame.format == PixelFormat::kGrey8 ? 0 : static_cast<size_t>(y % 2 * 2);
    const size_t alternates = frame.format == PixelFormat::kGrey8 ? 0 : 1;
    if (frame.format == PixelFormat::kRgb8) {
      for (int x = 0; x < frame.width_px; ++x)
        for (size_t c = 0; c < 3; ++c) ++counts[c][*row++];
    } else {
      for (size_t x = 0; x < static_cast<size_t>(frame.width_px); ++x)
        ++counts[first + (x & alternates)][row[x]];
    }
  }
  return counts;
}

// The level that one value in 1,000 exceeds.
int BrightLevel(const std::array<Histogram, 4>& counts) {
  constexpr uint64_t kOneIn = 1000;
  Histogram all{};
  for (const Histogram& histogram : counts)
    for (size_t level = 0; level < all.size(); ++level) all[level] += histogram[level];
  const uint64_t total = std::accumulate(all.begin(), all.end(), uint64_t{0});
  uint64_t above = 0;
  int level = kWhite;
  while (level > 0 && (above += all[static_cast<size_t>(level)]) * kOneIn <= total) --level;
  return level;
}

// Between the levels that occur. Those of a picture that was stretched are evenly apart, those of a drawing
// are not: it has no more colours.
float StepOf(const Histogram& counts) {
  constexpr size_t kFewest = 5;
  std::vector<int> gaps;
  int last = -1;
  for (int level = 0; level < 255; ++level) {
    if (counts[static_cast<size_t>(level)] == 0) continue;
    if (last >= 0) gaps.push_back(level - last);
    last = level;
  }
  if (gaps.size() < kFewest) return 1;
  std::sort(gaps.begin(), gaps.end());
  const int usual = gaps[gaps.size() / 4];
  const auto even =
      std::count_if(gaps.begin(), gaps.end(), [usual](int gap) { return gap == usual || gap == usual + 1; });
  return 4 * even >= 3 * static_cast<std::ptrdiff_t>(gaps.size()) ? static_cast<float>(usual) : 1.0f;
}

}  // namespace

Exposure MeasureExposure(const Frame& frame) {
  constexpr int kBright = 240;  // to where the brightest are moved, so that few become white
  const std::array<Histogram, 4> counts = CountLevels(frame);
  float step = 1;
  for (const Histogram& histogram : counts) step = std::max(step, StepOf(histogram));
  const int gain = std::max(1, kBright / std::max(1, BrightLevel(counts)));
  return {gain, static_cast<float>(gain) * step};
}

Frame Brightened(const Frame& frame, int gain) {
  auto pixels = std::make_shared<std::vector<uint8_t>>(*frame.pixels);
  for (uint8_t& value : *pixels) value = static_cast<uint8_t>(std::min(gain * value, kWhite));
  Frame bright = frame;
  bright.pixels = std::move(pixels);
  return bright;
}

}  // namespace weft
