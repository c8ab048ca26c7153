// Times in names of frames, as recorders write them: "1623840123456789012", "1305031102.175304".
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace weft {

struct FrameTimes {
  std::vector<int64_t> times_ns;  // of each name, rising
  // Of the frame sets, rising from 0: times in steps of the usual period, rounded.
  std::vector<uint64_t> numbers;
  std::string words;  // "times in ns since 1970, usually 33.333 ms apart"
};

// Names are times where they say so: s, ms, us or ns since 1970, as their size tells; seconds with a
// fraction; regular steps of 2 ms to 1.1 s in us or ns; and regular steps in ms, us or ns that fit `fps` (0:
// not known). Small numbers are numbers of frames. Nothing where names are no times. InvalidArgument: times
// whose period does not fit `fps`.
absl::StatusOr<std::optional<FrameTimes>> TimesInNames(const std::vector<std::string>& names, double fps);

}  // namespace weft
