// The measures of `weft evaluate`: one name, unit and text for each, whatever it is of and wherever it is
// shown.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace weft {

// kReference: of the truth, the same for all results.
enum class BetterValue { kLower, kHigher, kNeither, kReference };

struct Measure {
  const char* name;  // key in JSON, column in CSV, name of its plot: "jitter_observed_mm"
  const char* unit;  // "mm"; "%" with values from 0 to 1; empty for counts
  int decimals;      // of shown values, those of a share as per cent
  BetterValue better;
  const char* title;       // "Jitter, observed"
  const char* heading;     // of a narrow column: "jitter"
  const char* definition;  // a part of a sentence
};

// Names differ.
std::span<const Measure> Measures();
// Precondition: there is one.
const Measure& MeasureNamed(std::string_view name);

// "Jitter, observed, mm"; `heading` instead of the title where `narrow`.
std::string TitleWithUnit(const Measure& measure, bool narrow = false);

// The value in the unit as it is read: shares as per cent.
double InShownUnit(const Measure& measure, double value);

}  // namespace weft
