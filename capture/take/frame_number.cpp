#include "capture/take/frame_number.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string_view>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "base/natural_order.h"
#include "capture/file/name_forms.h"

namespace weft {
namespace {

// "frame_", "12", "" of "frame_12".
struct NameParts {
  std::string_view before, digits, after;
};

NameParts PartsOf(std::string_view name) {
  size_t end = name.size();
  while (end > 0 && !IsDigit(name[end - 1])) --end;
  size_t begin = end;
  while (begin > 0 && IsDigit(name[begin - 1])) --begin;
  return {name.substr(0, begin), name.substr(begin, end - begin), name.substr(end)};
}

// "12" and "5" of "12.5".
bool IsFraction(std::string_view name) {
  const size_t point = name.find('.');
  if (point == 0 || point == std::string_view::npos || point + 1 == name.size()) return false;
  return std::count_if(name.begin(), name.end(), IsDigit) == static_cast<std::ptrdiff_t>(name.size() - 1);
}

// "t_" of "t_1623840123.45": what stands before a time since 1970.
std::string_view BeforeTime(std::string_view name) {
  const size_t first = static_cast<size_t>(std::find_if(name.begin(), name.end(), IsDigit) - name.begin());
  const std::string_view rest = name.substr(first);
  return IsFraction(rest) && rest.find('.') >= kDigitsOfTime ? name.substr(0, first) : std::string_view();
}

// Fractions as whole numbers, by as many digits as the longest has.
std::vector<std::string> Scaled(const std::vector<std::string>& names) {
  size_t digits = 0;
  for (const std::string& name : names) digits = std::max(digits, name.size() - name.find('.') - 1);
  std::vector<std::string> scaled;
  for (const std::string& name : names) {
    const size_t point = name.find('.');
    std::string fraction = name.substr(point + 1);
    fraction.resize(digits, '0');
    scaled.push_back(absl::StrCat(name.substr(0, point), fraction));
  }
  return scaled;
}

}  // namespace

std::optional<std::vector<int64_t>> FrameNumbers(const std::vector<std::string>& names) {
  if (names.empty()) return std::nullopt;
  const bool fractions =
      std::all_of(names.begin(), names.end(), [](const std::string& name) { return IsFraction(name); });
  if (fractions) return FrameNumbers(Scaled(names));
  const std::string_view before = BeforeTime(names.front());
  if (!before.empty() && std::all_of(names.begin(), names.end(), [before](const std::string& name) {
        return BeforeTime(name) == before;
      })) {
    std::vector<std::string> times;
    for (const std::string& name : names) times.push_back(name.substr(before.size()));
    return FrameNumbers(times);
  }
  const NameParts first = PartsOf(names.front());
  std::vector<int64_t> numbers;
  for (const std::string& name : names) {
    const NameParts parts = PartsOf(name);
    int64_t number = 0;
    const bool alike = parts.before == first.before && parts.after == first.after;
    if (!alike || !absl::SimpleAtoi(std::string(parts.digits), &number)) return std::nullopt;
    numbers.push_back(number);
  }
  return numbers;
}

FrameSteps::FrameSteps(const std::vector<std::string>& names) {
  const std::optional<std::vector<int64_t>> numbers = FrameNumbers(names);
  if (!numbers || numbers->size() < 2) return;
  std::vector<int64_t> steps;
  for (size_t i = 1; i < numbers->size(); ++i) steps.push_back((*numbers)[i] - (*numbers)[i - 1]);
  if (*std::min_element(steps.begin(), steps.end()) <= 0) return;
  // Of an even count the lower one: gaps are the exception.
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>((steps.size() - 1) / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  usual_ = *middle;
  numbers_ = *numbers;
}

int64_t FrameSteps::Between(size_t from, size_t to) const {
  if (numbers_.empty()) return static_cast<int64_t>(to) - static_cast<int64_t>(from);
  // No overflow: both are 0 or more. A remainder of half a step counts as one.
  const int64_t way = numbers_[to] - numbers_[from];
  const int64_t size = std::abs(way), whole = size / usual_, rest = size % usual_;
  const int64_t steps = whole + (rest >= usual_ - rest ? 1 : 0);
  return way < 0 ? -steps : steps;
}

}  // namespace weft
