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
  // The file says when it is shown, not only when it is decoded.
  bool is_shown_by_itself = false;
};

// Lines of ffprobe, "pts,dts,flags"; packets without any time are left out. InvalidArgument: more than any
// film has.
absl::StatusOr<std::vector<VideoPacket>> ParsePackets(std::string_view csv);

// Of the first video stream of the file, which is read once. `log` gets all that ffprobe says of the file.
// Errors of VideoProgram and ParsePackets.
absl::StatusOr<std::vector<VideoPacket>> ReadPackets(const std::string& path, std::string* log = nullptr);

}  // namespace weft
