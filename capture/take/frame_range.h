// Which frames of a recording are meant: the one way in which all commands name them.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace weft {

struct FrameRange {
  size_t first = 0;
  size_t end = 0;  // excluded
};

// Positions in `names` (in order of time, numbers by value) of the frames that `text` names. It is one
// frame "0003", or a range "0003:0010" without its end. Either side may be left out; an empty text means
// all. Numbers match names by value, and need not occur in a range ("3:10" of frames 0001, 0004, 0008 is
// two). Where names are not numeric, numbers are positions. `source` is the recording, for messages.
// InvalidArgument: an unknown frame, or no frame in the range; the message names the existing ones.
absl::StatusOr<FrameRange> FindFrameRange(const std::string& text, const std::vector<std::string>& names,
                                          const std::string& source);

// "it has 12 frames, 0000 to 0011".
std::string FramesThere(const std::vector<std::string>& names);

}  // namespace weft
