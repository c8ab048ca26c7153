// Many errors in a few numbers.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

namespace weft {

// Errors of a kind; percentiles are interpolated linearly.
struct ErrorSummary {
  int64_t count = 0;
  double mean = 0, median = 0, p95 = 0, max = 0, p99 = 0;
};
// Empty when there are no errors to summarize.
std::optional<ErrorSummary> Summarize(std::vector<double> errors);

}  // namespace weft
