// The coded pictures of a video, in the order in which they are decoded.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace weft {

struct VideoPacket {
  int64_t pts = 0, dts = 0;  // each stands in for the other where the file lacks it
  bool is_key = false;
  bool is_hidden = false;  // by the edit list: decoded, never shown
};

// Lines of ffprobe, "pts,dts,flags"; packets without any time are left out. InvalidArgument: more than any
// film has.
absl::StatusOr<std::vector<VideoPacket>> ParsePackets(std::string_view csv);

// Of the first video stream of the file, which is read once. Errors of VideoProgram and ParsePackets.
absl::StatusOr<std::vector<VideoPacket>> ReadPackets(const std::string& path);

}  // namespace weft
