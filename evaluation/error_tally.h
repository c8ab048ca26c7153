// Errors of a kind, as many as a long take has, in bounded memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "evaluation/error_summary.h"

namespace weft {

// Collects errors one by one and from other tallies. Up to kExact of them are kept, and their summary is
// exact. Beyond, they are counted in bins of at most 0.2 % of their value: number, mean and largest stay
// exact, percentiles are interpolated within a bin. At most 2.2 MB. The same numbers for the same errors in
// the same order. Errors are finite and not negative.
class ErrorTally {
 public:
  static constexpr size_t kExact = size_t{1} << 18;

  void push_back(double error);
  // Precondition: neither is sealed.
  ErrorTally& operator+=(const ErrorTally& other);

  size_t size() const { return static_cast<size_t>(count_); }
  bool empty() const { return count_ == 0; }
  // In the order in which they came; empty once they are more than kExact, or sealed.
  const std::vector<double>& values() const { return values_; }

  // Keeps the summary alone; nothing can be added any more.
  void Seal();
  std::optional<ErrorSummary> Summary() const;

 private:
  void Count(double error);
  void MoveToBins();

  int64_t count_ = 0;
  std::vector<double> values_;
  // Once they are too many.
  std::vector<int64_t> bins_;
  double sum_ = 0, max_ = 0;
  std::optional<ErrorSummary> sealed_;
};

inline std::optional<ErrorSummary> Summarize(const ErrorTally& errors) { return errors.Summary(); }

}  // namespace weft
