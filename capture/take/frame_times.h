// Times in names of frames, as recorders write them: "1623840123456789012", "1305031102.175304".
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace weft {

struct FrameTimes {
  std::vector<int64_t> times_ns;  // of each name, rising
  // Of the frame sets, rising from 0: times in steps of the usual period, rounded.
  std::vector<uint64_t> numbers;
  std::string words;  // "times in ns since 1970, usually 33.333 ms apart"
};

// What the numbers in names of frames are.
enum class NameMeaning { kAuto, kNumbers, kSeconds, kMilliseconds, kMicroseconds, kNanoseconds, kClock };

// "auto", "numbers", "s", "ms", "us", "ns", "clock"; InvalidArgument: another name, with the list of them.
absl::StatusOr<NameMeaning> NameMeaningFromName(std::string_view name);

// Names that differ in one number or clock alone. With kAuto they are times where they say so:
// - clocks (ClocksInNames);
// - s, ms, us or ns since 1970, as their size tells; seconds with a fraction;
// - steps of 2 ms to 1.1 s in us or ns, which are regular, or whose numbers are beyond a film's;
// - regular steps in ms, us or ns that fit `fps` (0: not known);
// - uneven steps in ms, as rounding makes them, that fit a rate of films and cameras.
// Small numbers are numbers of frames. Nothing where names are no times, or kNumbers. InvalidArgument: times
// whose period does not fit `fps`; clocks that go over midnight; names that are not as `meaning` says.
absl::StatusOr<std::optional<FrameTimes>> TimesInNames(const std::vector<std::string>& names, double fps,
                                                       NameMeaning meaning = NameMeaning::kAuto);

// Of names that are taken as numbers of frames: what is to be said where they may be times as well, with the
// remedy; else empty.
std::string DoubtOfNumbers(const std::vector<std::string>& names);

}  // namespace weft
