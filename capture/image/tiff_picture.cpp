#include "capture/image/tiff_picture.h"

#include <algorithm>
#include <iterator>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"

namespace weft {
namespace {

// More images than any camera or program writes: each costs a look at its directory.
constexpr size_t kMostImages = 1000;

struct Image {
  uint64_t directory = 0;  // its place in the file
  uint32_t width_px = 0, height_px = 0, subfile = 0;
  uint16_t photometric = PHOTOMETRIC_MINISBLACK, orientation = ORIENTATION_TOPLEFT;
  bool is_raw_file = false;

  bool is_mask() const { return (subfile & FILETYPE_MASK) != 0 || photometric == PHOTOMETRIC_MASK; }
  bool is_reduced() const { return (subfile & FILETYPE_REDUCEDIMAGE) != 0; }
};

Image CurrentImage(TIFF* tiff) {
  Image image;
  image.directory = TIFFCurrentDirOffset(tiff);
  TIFFGetField(tiff, TIFFTAG_IMAGEWIDTH, &image.width_px);
  TIFFGetField(tiff, TIFFTAG_IMAGELENGTH, &image.height_px);
  TIFFGetField(tiff, TIFFTAG_SUBFILETYPE, &image.subfile);
  TIFFGetField(tiff, TIFFTAG_PHOTOMETRIC, &image.photometric);
  TIFFGetField(tiff, TIFFTAG_ORIENTATION, &image.orientation);
  const void* version = nullptr;
  image.is_raw_file = TIFFGetField(tiff, TIFFTAG_DNGVERSION, &version) == 1;
  return image;
}

void AddSubImages(TIFF* tiff, std::vector<uint64_t>& directories) {
  uint16_t count = 0;
  const uint64_t* offsets = nullptr;
  if (TIFFGetField(tiff, TIFFTAG_SUBIFD, &count, &offsets) == 1 && offsets != nullptr)
    directories.insert(directories.end(), offsets, offsets + count);
}

absl::Status TooMany() {
  return absl::InvalidArgumentError(
      absl::StrCat("more than ", kMostImages, " images in one TIFF file; write one image per file"));
}

// Of the chain of directories and of their SubIFDs, where thumbnails and pyramids may lie as well.
absl::StatusOr<std::vector<Image>> AllImages(TIFF* tiff) {
  std::vector<Image> images;
  std::vector<uint64_t> sub_images;
  do {
    images.push_back(CurrentImage(tiff));
    AddSubImages(tiff, sub_images);
    if (images.size() + sub_images.size() > kMostImages) return TooMany();
  } while (TIFFReadDirectory(tiff) == 1);
  for (const uint64_t directory : sub_images) {
    if (TIFFSetSubDirectory(tiff, directory) != 1)
      return absl::InvalidArgumentError("a SubIFD of the TIFF file cannot be read; copy the file again");
    images.push_back(CurrentImage(tiff));
  }
  return images;
}

// The images that are no masks, and no reduced ones where there are others.
std::vector<Image> FullImages(const std::vector<Image>& images) {
  std::vector<Image> unmasked, full;
  std::copy_if(images.begin(), images.end(), std::back_inserter(unmasked),
               [](const Image& image) { return !image.is_mask(); });
  if (unmasked.empty()) unmasked = images;
  std::copy_if(unmasked.begin(), unmasked.end(), std::back_inserter(full),
               [](const Image& image) { return !image.is_reduced(); });
  return full.empty() ? unmasked : full;
}

// Thumbnails without a label are far smaller; the second level of a pyramid is half as large.
bool IsClearlySmaller(const Image& image, const Image& than) {
  constexpr uint64_t kParts = 4, kAtMost = 3;
  return kParts * image.width_px <= kAtMost * than.width_px &&
         kParts * image.height_px <= kAtMost * than.height_px;
}

}  // namespace

absl::StatusOr<TiffPicture> FindTiffPicture(TIFF* tiff) {
  WEFT_ASSIGN_OR_RETURN(const std::vector<Image> images, AllImages(tiff));
  if (images.front().is_raw_file)
    return absl::InvalidArgumentError("a camera's raw file (DNG); develop it, and write PNG or TIFF");
  const std::vector<Image> full = FullImages(images);
  const Image& largest = *std::max_element(full.begin(), full.end(), [](const Image& a, const Image& b) {
    return uint64_t{a.width_px} * a.height_px < uint64_t{b.width_px} * b.height_px;
  });
  for (const Image& image : full) {
    if (&image == &largest || IsClearlySmaller(image, largest)) continue;
    return absl::InvalidArgumentError(absl::StrCat(
        "holds ", full.size(), " images, of ", largest.width_px, "x", largest.height_px, " and ",
        image.width_px, "x", image.height_px,
        " pixels among others, and nothing says which is the picture; write one image per file"));
  }
  if (images.size() > 1 && TIFFSetSubDirectory(tiff, largest.directory) != 1)
    return absl::InvalidArgumentError("the TIFF image is damaged; copy the file again");
  const bool is_known = largest.orientation >= 1 && largest.orientation <= 8;
  return TiffPicture{largest.width_px, largest.height_px, is_known ? largest.orientation : 1};
}

}  // namespace weft
