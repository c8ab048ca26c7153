// sample.bin: an image, and the answer that the trainer got of an avatar's net (layout:
// docs/file-formats.md).
#pragma once

#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "animation/avatar/sparse_view_avatar.h"

namespace weft {

std::string EncodeNetSample(const AvatarNet& net);
// Fills in sample and answer. InvalidArgument names source_name and what is wrong.
absl::Status DecodeNetSample(std::string_view bytes, const std::string& source_name, AvatarNet* net);

}  // namespace weft
