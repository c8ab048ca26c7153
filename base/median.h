// Values by rank, without sorting all of them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace weft {

// The value at `rank`, from 0, in ascending order; 0 of none. Reorders the values, so that loops need no
// copy.
template <typename T>
T ValueAtRank(std::vector<T>& values, size_t rank) {
  if (values.empty()) return T{};
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// The upper median: of an even number of values, the larger of the two in the middle. 0 of none.
template <typename T>
T Median(std::vector<T> values) {
  return ValueAtRank(values, values.size() / 2);
}

// The value at this share, 0 to 1, of the way through the ranks, rounded down to one; 0 of none.
template <typename T>
T Quantile(std::vector<T> values, double share) {
  if (values.empty()) return T{};
  return ValueAtRank(values, static_cast<size_t>(share * static_cast<double>(values.size() - 1)));
}

}  // namespace weft
