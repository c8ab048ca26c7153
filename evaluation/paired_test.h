// Does a measure differ between two results of the same frames, or is the difference chance?
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace weft {

struct PairedTest {
  size_t count = 0;           // pairs of which both values are numbers
  double mean = 0;            // of the differences
  double standard_error = 0;  // of that mean
  int degrees_of_freedom = 0;
  double t = 0;
  double p = 1;  // two-sided: probability of a |t| as large where both are equally good
};

// Tests whether the mean of `differences`, [frames] in the order of time, is zero. Values that are not finite
// are left out. Neighbouring frames resemble each other, so the errors of the mean allow for autocorrelation:
// the equal-weighted cosine estimate of the long-run variance with 0.4 n^(2/3) cosines, at least one, and a
// Student distribution with as many degrees of freedom (Lazarus, Lewis, Stock and Watson 2018, "HAR
// Inference: Recommendations for Practice"). Empty with fewer than four values. Differences
// that are all the same are certain: p is 0, or 1 where they are zero.
std::optional<PairedTest> TestPairs(const std::vector<double>& differences);

// Two-sided probability of a Student variable of at least |t|; `degrees_of_freedom` is positive.
// Abramowitz and Stegun 1964, 26.7.3 and 26.7.4.
double StudentTwoSidedP(double t, int degrees_of_freedom);

// Of several tests at once, so that one of many is not significant by chance: Holm 1979. [tests], in the
// order given.
std::vector<double> HolmAdjusted(const std::vector<double>& p);

}  // namespace weft
