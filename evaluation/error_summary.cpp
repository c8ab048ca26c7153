#include "evaluation/error_summary.h"

#include <algorithm>

namespace weft {

std::optional<ErrorSummary> Summarize(std::vector<double> errors) {
  if (errors.empty()) return std::nullopt;
  std::sort(errors.begin(), errors.end());
  const auto percentile = [&errors](double share) {
    const double place = share * static_cast<double>(errors.size() - 1);
    const auto below = static_cast<size_t>(place);
    const size_t above = std::min(below + 1, errors.size() - 1);
    return errors[below] + (place - static_cast<double>(below)) * (errors[above] - errors[below]);
  };
  ErrorSummary out;
  out.count = static_cast<int64_t>(errors.size());
  for (const double e : errors) out.mean += e;
  out.mean /= static_cast<double>(errors.size());
  out.median = percentile(0.5);
  out.p95 = percentile(0.95);
  out.p99 = percentile(0.99);
  out.max = errors.back();
  return out;
}

}  // namespace weft
