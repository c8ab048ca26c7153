#include "capture/take/name_counts.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/take/frame_number.h"

namespace weft {
namespace {

// Empty where one of them is none.
absl::StatusOr<std::vector<int64_t>> StepsOf(const std::vector<int64_t>& numbers,
                                             const std::vector<std::string>& names, bool are_decimals) {
  std::vector<int64_t> steps;
  for (size_t i = 1; i < numbers.size(); ++i) {
    steps.push_back(numbers[i] - numbers[i - 1]);
    if (steps.back() > 0) continue;
    if (!are_decimals) return std::vector<int64_t>();
    return absl::InvalidArgumentError(
        absl::StrCat("names of frames: ", names[i - 1], " and ", names[i],
                     " are decimals of other lengths, whose order is not that of their values; write as many "
                     "digits behind the point in each"));
  }
  return steps;
}

}  // namespace

absl::StatusOr<std::optional<NameCounts>> CountsInNames(const std::vector<std::string>& names) {
  const std::optional<NumbersInNames> found = FindNumbers(names);
  const std::optional<std::vector<int64_t>> numbers = FrameNumbers(names);
  if (!found || !numbers) return std::nullopt;
  NameCounts counts{*numbers};
  size_t digits = 0;
  for (const std::string& number : found->numbers) {
    const size_t point = number.find('.');
    if (point == std::string::npos) continue;
    counts.has_fraction = true;
    digits = std::max(digits, number.size() - point - 1);
  }
  WEFT_ASSIGN_OR_RETURN(const std::vector<int64_t> steps, StepsOf(*numbers, names, counts.has_fraction));
  constexpr size_t kMostDigits = 9;
  if (digits > kMostDigits) return std::nullopt;
  counts.fraction_ns = std::llround(std::pow(10.0, static_cast<double>(kMostDigits - digits)));
  if (numbers->size() < 2) return counts;
  if (steps.empty()) return std::nullopt;
  counts.usual_step = UsualStep(steps);
  return counts;
}

double UsualStep(std::vector<int64_t> steps) {
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>((steps.size() - 1) / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  const double one = 1.75 * static_cast<double>(*middle);
  double sum = 0, count = 0;
  for (const int64_t step : steps) {
    if (static_cast<double>(step) > one) continue;
    sum += static_cast<double>(step);
    ++count;
  }
  return sum / count;
}

bool AreRegular(const NameCounts& counts) {
  if (counts.usual_step == 0) return false;
  constexpr double kOff = 0.2, kRounding = 1;
  for (size_t i = 1; i < counts.values.size(); ++i) {
    const double step = static_cast<double>(counts.values[i] - counts.values[i - 1]);
    const double whole = std::round(step / counts.usual_step);
    if (whole < 1 || std::abs(step - whole * counts.usual_step) > kOff * counts.usual_step + kRounding)
      return false;
  }
  return true;
}

bool AreUneven(const NameCounts& counts) {
  int64_t least = INT64_MAX;
  for (size_t i = 1; i < counts.values.size(); ++i)
    least = std::min(least, counts.values[i] - counts.values[i - 1]);
  for (size_t i = 1; i < counts.values.size(); ++i)
    if ((counts.values[i] - counts.values[i - 1]) % least != 0) return true;
  return false;
}

LineFit FitLine(const NameCounts& counts) {
  const std::vector<int64_t>& values = counts.values;
  std::vector<double> steps = {0};
  for (size_t i = 1; i < values.size(); ++i) {
    const double step = static_cast<double>(values[i] - values[i - 1]);
    steps.push_back(steps.back() + std::max(1.0, std::round(step / counts.usual_step)));
  }
  const auto value = [&](size_t i) { return static_cast<double>(values[i] - values.front()); };
  double step_mean = 0, value_mean = 0, squares = 0, products = 0;
  for (size_t i = 0; i < steps.size(); ++i) {
    step_mean += steps[i] / static_cast<double>(steps.size());
    value_mean += value(i) / static_cast<double>(steps.size());
  }
  for (size_t i = 0; i < steps.size(); ++i) {
    squares += (steps[i] - step_mean) * (steps[i] - step_mean);
    products += (steps[i] - step_mean) * (value(i) - value_mean);
  }
  LineFit fit{0, products / squares};
  fit.first = value_mean - fit.period * step_mean;
  for (size_t i = 0; i < steps.size(); ++i)
    fit.worst = std::max(fit.worst, std::abs(value(i) - fit.first - fit.period * steps[i]));
  return fit;
}

}  // namespace weft
