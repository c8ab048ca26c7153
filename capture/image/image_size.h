// Sizes of images, and the error of one that is not as large as the rig says.
#pragma once

#include <optional>
#include <string>

#include "absl/status/status.h"

namespace weft {

struct ImageSize {
  int width_px = 0;
  int height_px = 0;

  bool operator==(const ImageSize&) const = default;
};

std::string SizeText(const ImageSize& size);  // "640x480"

struct WrongSize {
  ImageSize found, expected;
};

// InvalidArgument: "image is 640x480, the rig says 800x600", after `where` and a colon unless it is empty.
absl::Status WrongSizeError(const std::string& where, const WrongSize& sizes);

// The sizes of such an error, also after StatusAt; nothing for others.
std::optional<WrongSize> WrongSizeOf(const absl::Status& status);

// The error with `where` and a colon before its message.
absl::Status StatusAt(const std::string& where, const absl::Status& status);

}  // namespace weft
