#include "capture/take/frame_codec.h"

#include <zstd.h>

#include <vector>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

// Bytes of a line, and the distance to the next byte of the same plane.
struct Planes {
  size_t line_bytes = 0;
  size_t step_x = 1;
  size_t step_y = 1;
};

bool IsMosaic(RawFormat format) { return RawFormatName(format).substr(0, 5) == "Bayer"; }

Planes PlanesOf(RawFormat format, int width_px, size_t frame_bytes) {
  const auto width = static_cast<size_t>(width_px);
  const size_t mosaic = IsMosaic(format) ? 2 : 1;
  switch (static_cast<uint32_t>(format) >> 16 & 0xff) {
    case 8:
      return {width, mosaic, mosaic};
    case 16:
      if (format == RawFormat::kYuyv || format == RawFormat::kUyvy) return {2 * width, 4, 1};
      return {2 * width, 2 * mosaic, mosaic};
    case 24:
      return {3 * width, 3, 1};
    default:  // packed pixels and JPEG: no planes to see
      return {frame_bytes, 1, 1};
  }
}

// Calls visit(first, count, has_above) for every line of every plane: `count` bytes at first, first + step_x,
// ...
template <typename Visit>
void ForEachPlaneLine(const Planes& planes, size_t frame_bytes, const Visit& visit) {
  const size_t lines = (frame_bytes + planes.line_bytes - 1) / planes.line_bytes;
  for (size_t py = 0; py < planes.step_y; ++py)
    for (size_t px = 0; px < planes.step_x; ++px)
      for (size_t y = py; y < lines; y += planes.step_y) {
        const size_t first = y * planes.line_bytes + px;
        const size_t end = std::min(frame_bytes, (y + 1) * planes.line_bytes);
        if (first < end) visit(first, (end - first + planes.step_x - 1) / planes.step_x, y >= planes.step_y);
      }
}

// What the byte is expected to be: the mean of its left and upper neighbour, or the one that there is.
uint8_t Predict(unsigned left, unsigned above, bool has_left, bool has_above) {
  if (has_left && has_above) return static_cast<uint8_t>((left + above) / 2);
  return static_cast<uint8_t>(has_left ? left : has_above ? above : 0);
}

void Residuals(const uint8_t* frame, const Planes& planes, size_t frame_bytes, uint8_t* out) {
  const size_t up = planes.step_y * planes.line_bytes;
  ForEachPlaneLine(planes, frame_bytes, [&](size_t first, size_t count, bool has_above) {
    const uint8_t* at = frame + first;
    *out++ = static_cast<uint8_t>(*at - Predict(0, has_above ? *(at - up) : 0, false, has_above));
    for (size_t i = 1; i < count; ++i) {
      at += planes.step_x;
      const unsigned left = *(at - planes.step_x);
      *out++ = static_cast<uint8_t>(*at - Predict(left, has_above ? *(at - up) : 0, true, has_above));
    }
  });
}

void Restore(const uint8_t* residuals, const Planes& planes, size_t frame_bytes, uint8_t* frame) {
  const size_t up = planes.step_y * planes.line_bytes;
  ForEachPlaneLine(planes, frame_bytes, [&](size_t first, size_t count, bool has_above) {
    uint8_t* at = frame + first;
    *at = static_cast<uint8_t>(*residuals++ + Predict(0, has_above ? *(at - up) : 0, false, has_above));
    for (size_t i = 1; i < count; ++i) {
      at += planes.step_x;
      const unsigned left = *(at - planes.step_x);
      *at = static_cast<uint8_t>(*residuals++ + Predict(left, has_above ? *(at - up) : 0, true, has_above));
    }
  });
}

}  // namespace

absl::StatusOr<std::unique_ptr<AlignedBuffer>> EncodeFrame(const RawFrame& frame, int zstd_level) {
  const size_t size = frame.bytes->size();
  std::vector<uint8_t> residuals(size);
  Residuals(frame.bytes->data(), PlanesOf(frame.format, frame.width_px, size), size, residuals.data());
  auto packed = std::make_unique<AlignedBuffer>(ZSTD_compressBound(size));
  const size_t used = ZSTD_compress(packed->data(), packed->size(), residuals.data(), size, zstd_level);
  if (ZSTD_isError(used)) return absl::InternalError(absl::StrCat("zstd: ", ZSTD_getErrorName(used)));
  packed->Shrink(used);
  return packed;
}

absl::StatusOr<std::unique_ptr<AlignedBuffer>> DecodeFrameBytes(const AlignedBuffer& packed, RawFormat format,
                                                                int width_px, uint64_t frame_bytes) {
  const unsigned long long size = ZSTD_getFrameContentSize(packed.data(), packed.size());
  if (size != frame_bytes || frame_bytes == 0)
    return absl::DataLossError("the packed frame has another size");
  std::vector<uint8_t> residuals(frame_bytes);
  const size_t used = ZSTD_decompress(residuals.data(), frame_bytes, packed.data(), packed.size());
  if (ZSTD_isError(used) || used != frame_bytes) {
    return absl::DataLossError(
        absl::StrCat("the packed frame cannot be unpacked: ", ZSTD_getErrorName(used)));
  }
  auto frame = std::make_unique<AlignedBuffer>(frame_bytes);
  Restore(residuals.data(), PlanesOf(format, width_px, frame_bytes), frame_bytes, frame->data());
  return frame;
}

}  // namespace weft
