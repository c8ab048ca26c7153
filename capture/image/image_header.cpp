#include "capture/image/image_header.h"

#include <fcntl.h>

#include <algorithm>
#include <array>
#include <initializer_list>
#include <string_view>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/file/posix_file.h"
#include "capture/image/exif_orientation.h"
#include "capture/image/image_decoders.h"
#include "capture/image/tiff_file.h"
#include "capture/image/tiff_picture.h"

namespace weft {
namespace {

// What precedes the pixels of a JPEG file: a thumbnail and colour profiles among others.
constexpr uint64_t kMostJpegHeaderBytes = uint64_t{4} << 20;
// More chunks than any program writes before the pixels: each costs a read.
constexpr int kMostPngChunks = 1000;

bool StartsWith(std::span<const uint8_t> bytes, std::initializer_list<uint8_t> start) {
  return bytes.size() >= start.size() && std::equal(start.begin(), start.end(), bytes.begin());
}

absl::StatusOr<ImageFormat> FormatOf(std::span<const uint8_t> bytes) {
  if (StartsWith(bytes, {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'})) return ImageFormat::kPng;
  if (StartsWith(bytes, {0xff, 0xd8})) return ImageFormat::kJpeg;
  for (const uint8_t version : {42, 43}) {
    if (StartsWith(bytes, {'I', 'I', version, 0}) || StartsWith(bytes, {'M', 'M', 0, version}))
      return ImageFormat::kTiff;
  }
  return absl::InvalidArgumentError("not a PNG, JPEG or TIFF image; convert it to one of them");
}

absl::StatusOr<ImageHeader> Checked(const ImageHeader& header, uint64_t width_px, uint64_t height_px) {
  constexpr uint64_t kMaxSidePx = 1 << 20;
  if (width_px == 0 || height_px == 0 || width_px > kMaxSidePx || height_px > kMaxSidePx) {
    return absl::InvalidArgumentError(
        absl::StrCat("the header says ", width_px, "x", height_px, " pixels; the file is damaged"));
  }
  return ImageHeader{header.format, static_cast<int>(width_px), static_cast<int>(height_px),
                     header.orientation};
}

// Bytes at a place of a file, or of its copy in memory; fewer at its end.
class HeaderBytes {
 public:
  explicit HeaderBytes(std::span<const uint8_t> bytes) : bytes_(bytes), size_(bytes.size()) {}
  HeaderBytes(const PosixFile& file, uint64_t size) : file_(&file), size_(size) {}

  std::span<const uint8_t> At(uint64_t offset, uint64_t count) {
    if (offset >= size_) return {};
    count = std::min(count, size_ - offset);
    if (file_ == nullptr) return bytes_.subspan(offset, count);
    read_.resize(count);
    if (!file_->ReadAt(read_.data(), count, offset).ok()) read_.clear();
    return read_;
  }
  uint64_t size() const { return size_; }

 private:
  std::span<const uint8_t> bytes_;
  const PosixFile* file_ = nullptr;
  uint64_t size_;
  std::vector<uint8_t> read_;
};

uint64_t BigEndian(std::span<const uint8_t> bytes) {
  uint64_t value = 0;
  for (const uint8_t byte : bytes.first(std::min<size_t>(bytes.size(), 4))) value = value << 8 | byte;
  return value;
}

// EXIF data of a chunk behind the pixels, which few programs write: the last bytes are searched, since the
// way there leads through the whole file.
int OrientationBehindPixels(HeaderBytes& source) {
  constexpr uint64_t kLastBytes = 1 << 16, kLengthBytes = 4;
  const std::span<const uint8_t> last =
      source.At(source.size() - std::min(source.size(), kLastBytes), kLastBytes);
  const std::string_view text(reinterpret_cast<const char*>(last.data()), last.size());
  const size_t name = text.rfind("eXIf");
  if (name == std::string_view::npos || name < kLengthBytes) return 1;
  const uint64_t size = BigEndian(last.subspan(name - kLengthBytes));
  return OrientationInExif(last.subspan(name + 4, std::min<uint64_t>(size, last.size() - name - 4)));
}

int OrientationOfPng(HeaderBytes& source) {
  constexpr uint64_t kFirst = 8, kHead = 8, kChecksum = 4;
  uint64_t at = kFirst;
  for (int i = 0; i < kMostPngChunks; ++i) {
    const std::span<const uint8_t> head = source.At(at, kHead);
    if (head.size() < kHead) return 1;
    const uint64_t size = BigEndian(head);
    const std::string_view name(reinterpret_cast<const char*>(head.data()) + 4, 4);
    if (name == "eXIf") return OrientationInExif(source.At(at + kHead, size));
    if (name == "IDAT") return OrientationBehindPixels(source);
    at += kHead + size + kChecksum;
  }
  return 1;
}

absl::StatusOr<ImageHeader> ReadPng(HeaderBytes& source) {
  constexpr uint64_t kBytes = 24;
  std::array<uint8_t, kBytes> head = {};
  const std::span<const uint8_t> found = source.At(0, kBytes);
  std::copy(found.begin(), found.end(), head.begin());
  const std::span<const uint8_t> bytes(head);
  if (found.size() < kBytes || BigEndian(bytes.subspan(12)) != 0x49484452)  // IHDR
    return absl::InvalidArgumentError("the header is damaged or truncated; copy the file again");
  absl::StatusOr<ImageHeader> header =
      Checked({ImageFormat::kPng}, BigEndian(bytes.subspan(16)), BigEndian(bytes.subspan(20)));
  if (header.ok()) header->orientation = OrientationOfPng(source);
  return header;
}

absl::StatusOr<ImageHeader> ReadTiff(TIFF* tiff, const std::string& problem) {
  const auto damaged = [&problem] {
    return absl::InvalidArgumentError(
        absl::StrCat("the header is damaged or truncated (", problem, "); copy the file again"));
  };
  if (tiff == nullptr) return damaged();
  WEFT_ASSIGN_OR_RETURN(const TiffPicture picture, FindTiffPicture(tiff));
  if (!problem.empty()) return damaged();
  return Checked({.format = ImageFormat::kTiff, .orientation = picture.orientation}, picture.width_px,
                 picture.height_px);
}

absl::StatusOr<ImageHeader> ReadHeaderOf(const std::string& path, HeaderBytes& source) {
  WEFT_ASSIGN_OR_RETURN(const ImageFormat format, FormatOf(source.At(0, 8)));
  if (format == ImageFormat::kPng) return ReadPng(source);
  if (format == ImageFormat::kJpeg) return ReadJpegHeader(source.At(0, kMostJpegHeaderBytes));
  TiffMemory memory;
  const TiffHandle tiff = OpenTiffFile(path, memory);
  return ReadTiff(tiff.get(), memory.problem);
}

}  // namespace

absl::StatusOr<ImageHeader> ReadImageHeader(std::span<const uint8_t> bytes) {
  WEFT_ASSIGN_OR_RETURN(const ImageFormat format, FormatOf(bytes));
  if (format == ImageFormat::kJpeg) return ReadJpegHeader(bytes);
  if (format == ImageFormat::kPng) {
    HeaderBytes source(bytes);
    return ReadPng(source);
  }
  TiffMemory memory;
  memory.data = bytes.data();
  memory.size = bytes.size();
  const TiffHandle tiff = OpenTiff(memory);
  return ReadTiff(tiff.get(), memory.problem);
}

absl::StatusOr<ImageHeader> ReadImageFileHeader(const std::string& path) {
  WEFT_ASSIGN_OR_RETURN(const PosixFile file, PosixFile::Open(path, O_RDONLY));
  WEFT_ASSIGN_OR_RETURN(const uint64_t size, file.Size());
  HeaderBytes source(file, size);
  const absl::StatusOr<ImageHeader> header = ReadHeaderOf(path, source);
  if (header.ok()) return header;
  return absl::Status(header.status().code(), absl::StrCat(path, ": ", header.status().message()));
}

std::string OrientationText(int orientation) {
  switch (orientation) {
    case 2:
      return "mirrored left to right";
    case 3:
      return "rotated by 180 degrees";
    case 4:
      return "mirrored top to bottom";
    case 5:
      return "mirrored left to right and rotated by 270 degrees clockwise";
    case 6:
      return "rotated by 90 degrees clockwise";
    case 7:
      return "mirrored left to right and rotated by 90 degrees clockwise";
    case 8:
      return "rotated by 270 degrees clockwise";
    default:
      return "as it is stored";
  }
}

}  // namespace weft
