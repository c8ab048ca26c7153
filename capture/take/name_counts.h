// Numbers in names of frames as samples of a line: how far apart they usually are, and how regularly.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace weft {

// Rising numbers of a unit that is yet to be found.
struct NameCounts {
  std::vector<int64_t> values;
  double usual_step = 0;  // the mean of those that are one; 0 of one frame
  bool has_fraction = false;
  int64_t fraction_ns = 0;  // one unit, of fractions of a second
};

// Numbers of names (FindNumbers). Nothing where they do not rise or have more than 9 digits behind the point.
// InvalidArgument: decimals that are not in the order of their values, as 1.5, 1.6, 1.55 are where names are
// ordered as versions.
absl::StatusOr<std::optional<NameCounts>> CountsInNames(const std::vector<std::string>& names);

// The mean of those that are one step by their lower median: of times in ms, steps are 33 and 34.
// Precondition: not empty.
double UsualStep(std::vector<int64_t> steps);

// Every step is a whole number of the usual ones, to a fifth of one and the rounding of both ends.
bool AreRegular(const NameCounts& counts);

// Some step is no whole number of the least one: 33 and 34, not 3 and 6. Precondition: two values or more.
bool AreUneven(const NameCounts& counts);

// Values as first + period * steps, least squares. Precondition: AreRegular.
struct LineFit {
  double first = 0;  // against the first value
  double period = 0;
  double worst = 0;  // residual
};
LineFit FitLine(const NameCounts& counts);

}  // namespace weft
