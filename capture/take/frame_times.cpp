#include "capture/take/frame_times.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "capture/take/frame_number.h"

namespace weft {
namespace {

struct Unit {
  const char* name;
  int64_t ns;
};
constexpr Unit kUnits[] = {{"s", 1'000'000'000}, {"ms", 1'000'000}, {"us", 1'000}, {"ns", 1}};

// A name's time as a whole number of units.
struct Count {
  std::vector<int64_t> values;
  double usual_step = 0;  // 0 of one frame
  bool has_fraction = false;
  int64_t fraction_ns = 0;  // of fractions of a second, one unit
};

// Digits, with one point among them or none.
bool IsNumber(const std::string& name) {
  const size_t point = name.find('.');
  return !name.empty() && name.find_first_not_of("0123456789.") == std::string::npos && point != 0 &&
         point != name.size() - 1 && point == name.rfind('.');
}

// The mean of those that are one step by their middle one: of times in ms, steps are 33 and 34.
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

// Steps between names; nothing where one of them is none. InvalidArgument: decimals that are not in the order
// of their values, as 1.5, 1.6, 1.55 are where names are ordered as versions.
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

absl::StatusOr<std::optional<Count>> CountsOf(const std::vector<std::string>& names) {
  if (!std::all_of(names.begin(), names.end(), IsNumber)) return std::nullopt;
  const std::optional<std::vector<int64_t>> numbers = FrameNumbers(names);
  if (!numbers) return std::nullopt;
  Count count{*numbers};
  size_t digits = 0;
  for (const std::string& name : names) {
    const size_t point = name.find('.');
    if (point == std::string::npos) continue;
    count.has_fraction = true;
    digits = std::max(digits, name.size() - point - 1);
  }
  const absl::StatusOr<std::vector<int64_t>> steps = StepsOf(*numbers, names, count.has_fraction);
  if (!steps.ok()) return steps.status();
  if (digits > 9) return std::nullopt;
  count.fraction_ns = std::llround(std::pow(10.0, static_cast<double>(9 - digits)));
  if (numbers->size() < 2) return count;
  if (steps->empty()) return std::nullopt;
  count.usual_step = UsualStep(*steps);
  return count;
}

// Every step is a whole number of the usual ones, to a fifth of one and the rounding of both ends.
bool IsRegular(const Count& count) {
  if (count.usual_step == 0) return false;
  constexpr double kOff = 0.2, kRounding = 1;
  for (size_t i = 1; i < count.values.size(); ++i) {
    const double step = static_cast<double>(count.values[i] - count.values[i - 1]);
    const double whole = std::round(step / count.usual_step);
    if (whole < 1 || std::abs(step - whole * count.usual_step) > kOff * count.usual_step + kRounding)
      return false;
  }
  return true;
}

// From 2000 to 2100. Ranges of the units do not meet.
bool IsSince1970(const Count& count, int64_t unit_ns) {
  constexpr int64_t kFirst_s = 946'684'800, kLast_s = 4'102'444'800, kSecond_ns = 1'000'000'000;
  const int64_t per_second = kSecond_ns / unit_ns;
  return count.values.front() / per_second >= kFirst_s && count.values.back() / per_second < kLast_s;
}

double Period_ns(const Count& count, int64_t unit_ns) {
  return count.usual_step * static_cast<double>(unit_ns);
}

// Whether frames come every period of `fps`, or every few of them.
bool FitsRate(double period_ns, double fps, int64_t most_periods) {
  constexpr double kOff = 0.02;
  const double periods = period_ns * fps * 1e-9, whole = std::round(periods);
  return whole >= 1 && whole <= static_cast<double>(most_periods) && std::abs(periods - whole) < kOff * whole;
}

// Numbers of frames step by less than a thousand; us and ns of a film by more.
bool IsFine(const Count& count, const Unit& unit) {
  constexpr double kShortest_ns = 2e6, kLongest_ns = 1.1e9;
  constexpr int64_t kCoarsest_ns = 1'000;
  const double period_ns = Period_ns(count, unit.ns);
  return unit.ns <= kCoarsest_ns && period_ns >= kShortest_ns && period_ns <= kLongest_ns && IsRegular(count);
}

struct Reading {
  int64_t unit_ns = 0;
  std::string words;
};

std::optional<Reading> ReadingOf(const Count& count, double fps) {
  if (count.has_fraction) {
    const bool since = IsSince1970(count, count.fraction_ns);
    return Reading{count.fraction_ns, since ? "times in s since 1970" : "times in s"};
  }
  for (const Unit& unit : kUnits) {
    // Whole seconds are numbers of frames as well, unless the rate says otherwise.
    const bool is_told = unit.ns < kUnits[0].ns || FitsRate(Period_ns(count, unit.ns), fps, 1);
    if (is_told && IsSince1970(count, unit.ns))
      return Reading{unit.ns, absl::StrCat("times in ", unit.name, " since 1970")};
  }
  for (const Unit& unit : kUnits) {
    const bool fits = unit.ns < kUnits[0].ns && count.usual_step > 1 && IsRegular(count) &&
                      FitsRate(Period_ns(count, unit.ns), fps, 1);
    if (IsFine(count, unit) || fits) return Reading{unit.ns, absl::StrCat("times in ", unit.name)};
  }
  return std::nullopt;
}

}  // namespace

absl::StatusOr<std::optional<FrameTimes>> TimesInNames(const std::vector<std::string>& names, double fps) {
  const absl::StatusOr<std::optional<Count>> counts = CountsOf(names);
  if (!counts.ok()) return counts.status();
  const std::optional<Count>& count = *counts;
  if (!count) return std::nullopt;
  const std::optional<Reading> reading = ReadingOf(*count, fps);
  // Of 64 bits of ns: 292 years.
  if (!reading || count->values.back() > INT64_MAX / reading->unit_ns) return std::nullopt;
  FrameTimes times;
  times.words = reading->words;
  const double period_ns = Period_ns(*count, reading->unit_ns);
  if (period_ns > 0) absl::StrAppendFormat(&times.words, ", usually %.3f ms apart", period_ns * 1e-6);
  constexpr int64_t kMostPeriods = 1000;
  if (fps > 0 && period_ns > 0 && !FitsRate(period_ns, fps, kMostPeriods)) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "fps: the names of the frames are %s, and %g frames a second are %.3f ms apart; leave "
        "the rate out",
        times.words, fps, 1e3 / fps));
  }
  const double step_ns = fps > 0 ? 1e9 / fps : std::max(period_ns, 1.0);
  for (const int64_t value : count->values) {
    const double since_first_ns =
        static_cast<double>(value - count->values.front()) * static_cast<double>(reading->unit_ns);
    const uint64_t next = times.numbers.empty() ? 0 : times.numbers.back() + 1;
    times.times_ns.push_back(value * reading->unit_ns);
    times.numbers.push_back(std::max(next, static_cast<uint64_t>(std::llround(since_first_ns / step_ns))));
  }
  return times;
}

}  // namespace weft
