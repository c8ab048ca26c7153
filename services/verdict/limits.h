// Every limit of every verdict. docs/verdicts.md shows the same table, and a test compares the two.
#pragma once

#include <array>

#include "absl/strings/string_view.h"

namespace weft {

enum class Better { kMore, kLess };

// A value that is at least (kMore) or at most (kLess) `good` is good, one that reaches `usable` is usable,
// anything else is bad. NaN is bad.
struct Limit {
  absl::string_view id;    // "take.complete_sets"
  absl::string_view name;  // as operators say it
  absl::string_view unit;  // "%", "ms", "px"; empty for counts
  double good;
  double usable;
  Better better;
  int decimals;              // of the value as it is printed
  absl::string_view remedy;  // one sentence: what to do where the value falls short
};

// Recorded takes.
inline constexpr Limit kTakeCompleteSets{
    "take.complete_sets",
    "frame sets with all cameras",
    "%",
    99,
    90,
    Better::kMore,
    1,
    "Run `weft take sync` to see which camera lacks frames and why, mend that, and record again."};

// In the order of docs/verdicts.md.
inline constexpr std::array kLimits = {&kTakeCompleteSets};

}  // namespace weft
