#include "capture/image/image_header.h"

#include <algorithm>
#include <optional>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

// Numbers of either byte order; whatever lies outside the file is 0, and the reader is no longer ok.
class NumberReader {
 public:
  NumberReader(std::span<const uint8_t> bytes, bool big_endian) : bytes_(bytes), big_endian_(big_endian) {}

  uint64_t At(uint64_t offset, int size) {
    if (offset > bytes_.size() || bytes_.size() - offset < static_cast<uint64_t>(size)) ok_ = false;
    uint64_t value = 0;
    for (int i = 0; ok_ && i < size; ++i) {
      const uint64_t byte = bytes_[offset + static_cast<uint64_t>(i)];
      value |= byte << (8 * (big_endian_ ? size - 1 - i : i));
    }
    return value;
  }
  bool ok() const { return ok_; }

 private:
  std::span<const uint8_t> bytes_;
  bool big_endian_;
  bool ok_ = true;
};

bool StartsWith(std::span<const uint8_t> bytes, std::initializer_list<uint8_t> start) {
  return bytes.size() >= start.size() && std::equal(start.begin(), start.end(), bytes.begin());
}

absl::StatusOr<ImageHeader> Checked(ImageFormat format, uint64_t width_px, uint64_t height_px) {
  constexpr uint64_t kMaxSidePx = 1 << 20;
  if (width_px == 0 || height_px == 0 || width_px > kMaxSidePx || height_px > kMaxSidePx) {
    return absl::InvalidArgumentError(
        absl::StrCat("the header says ", width_px, "x", height_px, " pixels; the file is damaged"));
  }
  return ImageHeader{format, static_cast<int>(width_px), static_cast<int>(height_px)};
}

absl::Status NoSize() {
  return absl::InvalidArgumentError("the header is damaged or truncated; copy the file again");
}

absl::StatusOr<ImageHeader> ReadPng(std::span<const uint8_t> bytes) {
  NumberReader reader(bytes, /*big_endian=*/true);
  const bool has_size = reader.At(12, 4) == 0x49484452;  // IHDR
  const uint64_t width_px = reader.At(16, 4), height_px = reader.At(20, 4);
  return has_size && reader.ok() ? Checked(ImageFormat::kPng, width_px, height_px) : NoSize();
}

// Markers until the one that starts the frame.
absl::StatusOr<ImageHeader> ReadJpeg(std::span<const uint8_t> bytes) {
  NumberReader reader(bytes, /*big_endian=*/true);
  for (uint64_t at = 2; reader.ok();) {
    if (reader.At(at, 1) != 0xff) return NoSize();
    const uint64_t marker = reader.At(at + 1, 1);
    if (marker == 0xff) {  // padding
      ++at;
      continue;
    }
    const bool starts_frame = marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 &&
                              marker != 0xcc;  // tables, reserved, arithmetic conditioning
    if (starts_frame) {
      const uint64_t height_px = reader.At(at + 5, 2), width_px = reader.At(at + 7, 2);
      return reader.ok() ? Checked(ImageFormat::kJpeg, width_px, height_px) : NoSize();
    }
    if (marker == 0xd9 || marker == 0xda) return NoSize();  // the end, or pixels
    const bool has_length = marker != 0x01 && (marker < 0xd0 || marker > 0xd7);
    at += 2 + (has_length ? std::max<uint64_t>(reader.At(at + 2, 2), 2) : 0);
  }
  return NoSize();
}

absl::StatusOr<ImageHeader> ReadTiff(std::span<const uint8_t> bytes) {
  NumberReader reader(bytes, bytes[0] == 'M');
  const bool big = reader.At(2, 2) == 43;  // BigTIFF: offsets and counts of 8 bytes
  const int offset_bytes = big ? 8 : 4;
  const uint64_t directory = reader.At(big ? 8 : 4, offset_bytes);
  const uint64_t entries = reader.At(directory, big ? 8 : 2);
  const uint64_t entry_bytes = big ? 20 : 12;
  std::optional<uint64_t> width_px, height_px;
  for (uint64_t i = 0; i < entries && reader.ok(); ++i) {
    const uint64_t at = directory + (big ? 8 : 2) + i * entry_bytes;
    const uint64_t tag = reader.At(at, 2), type = reader.At(at + 2, 2);
    if (tag != 256 && tag != 257) continue;
    const int size = type == 3 ? 2 : type == 4 ? 4 : type == 16 ? 8 : 0;
    if (size == 0) return NoSize();
    (tag == 256 ? width_px : height_px) = reader.At(at + (big ? 12 : 8), size);
    if (width_px && height_px && reader.ok()) return Checked(ImageFormat::kTiff, *width_px, *height_px);
  }
  return NoSize();
}

}  // namespace

absl::StatusOr<ImageHeader> ReadImageHeader(std::span<const uint8_t> bytes) {
  if (StartsWith(bytes, {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'})) return ReadPng(bytes);
  if (StartsWith(bytes, {0xff, 0xd8})) return ReadJpeg(bytes);
  for (const uint8_t version : {42, 43}) {
    if (StartsWith(bytes, {'I', 'I', version, 0}) || StartsWith(bytes, {'M', 'M', 0, version}))
      return ReadTiff(bytes);
  }
  return absl::InvalidArgumentError("not a PNG, JPEG or TIFF image; convert it to one of them");
}

}  // namespace weft
