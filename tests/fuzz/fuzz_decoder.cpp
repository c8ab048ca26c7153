// The decoder's inputs: sizes, formats, amounts of pixels that do not fit them, and any values of the pixels.
#include <array>
#include <cmath>
#include <memory>

#include "pattern/decoder.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

const weft::BoardIndex& TheBoard() {
  static const weft::BoardIndex index = *weft::BoardIndex::Build(*weft::GenerateBoard(12, 12, 3.0, 2));
  return index;
}

// Format and size; the pixels follow, and are repeated where there are not enough.
constexpr size_t kHeader = 6;

void Check(const weft::Frame& frame, const weft::DecodeResult& result) {
  for (const weft::Observation& o : result.observations) {
    weft::FuzzRequire(o.x_px >= -0.5 && o.y_px >= -0.5);
    weft::FuzzRequire(o.x_px <= frame.width_px - 0.5 && o.y_px <= frame.height_px - 0.5);
    weft::FuzzRequire(o.node.row >= 0 && o.node.row <= 12 && o.node.col >= 0 && o.node.col <= 12);
    weft::FuzzRequire(std::isfinite(o.sigma_px) && o.sigma_px >= 0 && o.confidence >= 0 && o.confidence <= 1);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size <= kHeader) return 0;
  weft::Frame frame;
  frame.format = static_cast<weft::PixelFormat>(data[0] % 6);
  // Now and then a size that no memory holds.
  const int extreme = data[1] % 16 == 15 ? 1 << 28 : 0;
  frame.width_px = data[2] % 96 - 2 + extreme;
  frame.height_px = data[3] % 96 - 2;
  const int64_t pixels = static_cast<int64_t>(frame.width_px) * frame.height_px * BytesPerPixel(frame.format);
  const size_t count =
      extreme != 0 || pixels < 0 ? size : static_cast<size_t>(pixels) + (data[1] % 32 == 14 ? 1 : 0);
  auto bytes = std::make_shared<std::vector<uint8_t>>(count);
  for (size_t k = 0; k < count; ++k) {
    const uint8_t byte = data[kHeader + k % (size - kHeader)];
    (*bytes)[k] = data[4] % 2 != 0 ? static_cast<uint8_t>(byte < 128 ? 0 : 255) : byte;
  }
  frame.pixels = bytes;
  weft::DecodeOptions options;
  options.explain = data[5] % 2 != 0;
  const auto result = weft::DecodeView(frame, TheBoard(), options);
  if (result.ok()) Check(frame, *result);
  return 0;
}

// Cells as they are printed, in several formats and sizes.
std::vector<std::string> weft::FuzzSeeds() {
  std::vector<std::string> seeds;
  const Board& board = TheBoard().board();
  for (const std::array<int, 3> shape : {std::array{1, 72, 60}, {2, 64, 64}, {1, 12, 90}, {0, 30, 30}}) {
    const auto [format, width, height] = shape;
    std::string seed = {static_cast<char>(format),     0, static_cast<char>(width + 2),
                        static_cast<char>(height + 2), 0, 1};
    const int channels = format == 1 ? 3 : 1;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const bool ink = x % 6 < 1 || x % 6 > 4 || y % 6 < 1 || y % 6 > 4;
        const auto rgb = CellColorRgb(board.at(y / 6 % 12, x / 6 % 12));
        for (int c = 0; c < channels; ++c)
          seed.push_back(static_cast<char>(ink ? 20 : rgb[channels == 3 ? c : (x % 2 + y % 2)]));
      }
    }
    seeds.push_back(seed);
  }
  return seeds;
}
