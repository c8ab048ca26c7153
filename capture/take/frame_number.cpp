#include "capture/take/frame_number.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string_view>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "base/natural_order.h"
#include "capture/file/name_forms.h"
#include "capture/take/name_clocks.h"

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

// "t_" of "t_1623840123.45" and "t_0.033": what stands before a fraction, which ends the name.
std::string_view BeforeFraction(std::string_view name) {
  const size_t point = name.rfind('.');
  if (point == std::string_view::npos) return {};
  size_t begin = point;
  while (begin > 0 && IsDigit(name[begin - 1])) --begin;
  return IsFraction(name.substr(begin)) ? name.substr(0, begin) : std::string_view();
}

bool IsWhole(std::string_view name) {
  return !name.empty() && std::all_of(name.begin(), name.end(), IsDigit);
}

size_t DigitsBehindPoint(std::string_view number) {
  const size_t point = number.find('.');
  return point == std::string_view::npos ? 0 : number.size() - point - 1;
}

// Not "v1.9" and "v1.10", nor "shot1.001" and "shot1.002".
bool AreTimes(const std::vector<std::string>& fractions) {
  constexpr size_t kFewest = 3;
  const auto whole = [](const std::string& one) { return one.substr(0, one.find('.')); };
  const size_t digits = DigitsBehindPoint(fractions.front());
  bool same = digits >= kFewest, differ = false, since_1970 = true;
  for (const std::string& one : fractions) {
    same = same && DigitsBehindPoint(one) == digits;
    differ = differ || whole(one) != whole(fractions.front());
    since_1970 = since_1970 && whole(one).size() >= kDigitsOfTime;
  }
  return since_1970 || (same && differ);
}

// Nothing where they are none.
std::optional<NumbersInNames> FindFractions(const std::vector<std::string>& names) {
  const std::string before(BeforeFraction(names.front()));
  // As programs print 0, 0.5, 1: whole ones without a point.
  const bool is_bare =
      std::any_of(names.begin(), names.end(), IsFraction) &&
      std::all_of(names.begin(), names.end(), [](const auto& n) { return IsFraction(n) || IsWhole(n); });
  NumbersInNames out{is_bare ? "" : before, "", {}};
  if (is_bare) {
    out.numbers = names;
    return out;
  }
  if (before.empty() || before.back() == '.') return std::nullopt;
  for (const std::string& name : names) {
    if (BeforeFraction(name) != before) return std::nullopt;
    out.numbers.push_back(name.substr(before.size()));
  }
  if (!AreTimes(out.numbers)) return std::nullopt;
  return out;
}

// Fractions as whole numbers, by as many digits as the longest has.
std::vector<std::string> Scaled(const std::vector<std::string>& names) {
  size_t digits = 0;
  for (const std::string& name : names) digits = std::max(digits, DigitsBehindPoint(name));
  std::vector<std::string> scaled;
  for (const std::string& name : names) {
    const size_t point = name.find('.');
    std::string fraction = point == std::string::npos ? "" : name.substr(point + 1);
    fraction.resize(digits, '0');
    scaled.push_back(absl::StrCat(name.substr(0, point), fraction));
  }
  return scaled;
}

}  // namespace

std::optional<NumbersInNames> FindNumbers(const std::vector<std::string>& names) {
  if (names.empty()) return std::nullopt;
  if (std::optional<NumbersInNames> fractions = FindFractions(names)) return fractions;
  const NameParts first = PartsOf(names.front());
  NumbersInNames out{std::string(first.before), std::string(first.after), {}};
  for (const std::string& name : names) {
    const NameParts parts = PartsOf(name);
    if (parts.digits.empty() || parts.before != first.before || parts.after != first.after)
      return std::nullopt;
    out.numbers.emplace_back(parts.digits);
  }
  return out;
}

std::optional<std::vector<int64_t>> FrameNumbers(const std::vector<std::string>& names) {
  const std::optional<NumbersInNames> found = FindNumbers(names);
  if (!found) return std::nullopt;
  std::vector<int64_t> numbers;
  const bool fractions = std::any_of(found->numbers.begin(), found->numbers.end(), IsFraction);
  for (const std::string& text : fractions ? Scaled(found->numbers) : found->numbers) {
    int64_t number = 0;
    if (!absl::SimpleAtoi(text, &number)) return std::nullopt;
    numbers.push_back(number);
  }
  return numbers;
}

FrameSteps::FrameSteps(const std::vector<std::string>& names) {
  const std::optional<NameClocks> clocks = ClocksInNames(names);
  const auto numbers = clocks ? std::optional(clocks->times_ns) : FrameNumbers(names);
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
