#include "capture/image/exif_orientation.h"

namespace weft {
namespace {

// ExifNumbers of either byte order; whatever lies outside the data is 0.
class ExifNumbers {
 public:
  explicit ExifNumbers(std::span<const uint8_t> bytes)
      : bytes_(bytes), big_endian_(!bytes.empty() && bytes[0] == 'M') {}

  uint64_t At(uint64_t offset, int size) const {
    if (offset > bytes_.size() || bytes_.size() - offset < static_cast<uint64_t>(size)) return 0;
    uint64_t value = 0;
    for (int i = 0; i < size; ++i) {
      const uint64_t byte = bytes_[offset + static_cast<uint64_t>(i)];
      value |= byte << (8 * (big_endian_ ? size - 1 - i : i));
    }
    return value;
  }

 private:
  std::span<const uint8_t> bytes_;
  bool big_endian_;
};

}  // namespace

int OrientationInExif(std::span<const uint8_t> exif) {
  constexpr uint64_t kOrientation = 274, kShort = 3, kEntryBytes = 12;
  const ExifNumbers numbers(exif);
  if (numbers.At(2, 2) != 42) return 1;
  const uint64_t directory = numbers.At(4, 4), entries = numbers.At(directory, 2);
  for (uint64_t i = 0; i < entries; ++i) {
    const uint64_t at = directory + 2 + i * kEntryBytes;
    if (numbers.At(at, 2) != kOrientation || numbers.At(at + 2, 2) != kShort) continue;
    const uint64_t value = numbers.At(at + 8, 2);
    return value >= 1 && value <= 8 ? static_cast<int>(value) : 1;
  }
  return 1;
}

}  // namespace weft
