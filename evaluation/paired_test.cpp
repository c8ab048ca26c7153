#include "evaluation/paired_test.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace weft {
namespace {

constexpr size_t kLeastPairs = 4;

double MeanOf(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

// Of values with mean `mean`: the variance of sqrt(n) times their mean.
double LongRunVariance(const std::vector<double>& values, double mean, int cosines) {
  const auto n = static_cast<double>(values.size());
  double sum = 0;
  for (int j = 1; j <= cosines; ++j) {
    double projection = 0;
    for (size_t i = 0; i < values.size(); ++i)
      projection += (values[i] - mean) * std::cos(M_PI * j * (static_cast<double>(i) + 0.5) / n);
    sum += 2 / n * projection * projection;
  }
  return sum / cosines;
}

}  // namespace

double StudentTwoSidedP(double t, int degrees_of_freedom) {
  const double theta = std::atan(std::abs(t) / std::sqrt(degrees_of_freedom));
  const double cosine = std::cos(theta), sine = std::sin(theta);
  const bool odd = degrees_of_freedom % 2 == 1;
  double term = odd ? cosine : 1, sum = degrees_of_freedom == 1 ? 0 : term;
  for (int k = odd ? 3 : 2; k <= degrees_of_freedom - 2; k += 2) {
    term *= cosine * cosine * (k - 1) / k;
    sum += term;
  }
  const double inside = odd ? 2 / M_PI * (theta + sine * sum) : sine * sum;
  return std::clamp(1 - inside, 0.0, 1.0);
}

std::optional<PairedTest> TestPairs(const std::vector<double>& differences) {
  std::vector<double> values = differences;
  std::erase_if(values, [](double value) { return !std::isfinite(value); });
  if (values.size() < kLeastPairs) return std::nullopt;
  const auto n = static_cast<double>(values.size());
  PairedTest test;
  test.count = values.size();
  test.degrees_of_freedom = std::max(1, static_cast<int>(0.4 * std::pow(n, 2.0 / 3)));
  test.mean = MeanOf(values);
  // What rounding leaves of equal values is no spread.
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  if (*high - *low <= 1e-12 * std::max(std::abs(*high), std::abs(*low))) {
    test.t = test.mean == 0 ? 0 : std::copysign(std::numeric_limits<double>::infinity(), test.mean);
    test.p = test.mean == 0 ? 1 : 0;
    return test;
  }
  test.standard_error = std::sqrt(LongRunVariance(values, test.mean, test.degrees_of_freedom) / n);
  test.t = test.mean / test.standard_error;
  test.p = StudentTwoSidedP(test.t, test.degrees_of_freedom);
  return test;
}

std::vector<double> HolmAdjusted(const std::vector<double>& p) {
  std::vector<size_t> order(p.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return p[a] < p[b]; });
  std::vector<double> adjusted(p.size());
  double largest = 0;
  for (size_t k = 0; k < order.size(); ++k) {
    largest = std::max(largest, std::min(1.0, static_cast<double>(p.size() - k) * p[order[k]]));
    adjusted[order[k]] = largest;
  }
  return adjusted;
}

}  // namespace weft
