#include "capture/take/name_clocks.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <string_view>
#include <utility>

#include "absl/strings/numbers.h"
#include "capture/file/name_forms.h"

namespace weft {
namespace {

constexpr int64_t kSecond_ns = 1'000'000'000, kMinute_ns = 60 * kSecond_ns;
constexpr size_t kDayDigits = 8, kTimeDigits = 6, kMostFractionDigits = 9, kFrameDigits = 2;

// A name as runs of digits and what stands between them.
struct Runs {
  std::vector<std::string> digits, between;  // between[i] stands before digits[i], the last one behind all
};

Runs RunsOf(std::string_view name) {
  Runs out;
  out.between.emplace_back();
  for (size_t i = 0; i < name.size(); ++i) {
    if (!IsDigit(name[i])) {
      if (out.digits.size() == out.between.size()) out.between.emplace_back();
      out.between.back() += name[i];
      continue;
    }
    if (out.digits.size() < out.between.size()) out.digits.emplace_back();
    out.digits.back() += name[i];
  }
  if (out.digits.size() == out.between.size()) out.between.emplace_back();
  return out;
}

bool AreAlike(const Runs& a, const Runs& b) {
  return a.between == b.between &&
         std::equal(a.digits.begin(), a.digits.end(), b.digits.begin(), b.digits.end(),
                    [](const auto& one, const auto& other) { return one.size() == other.size(); });
}

// The runs from `first` on are a day, or none, and a clock.
struct ClockLayout {
  size_t first = 0, end = 0;
  bool has_day = false, has_marks = false;  // marks between hours, minutes and seconds
  bool fraction_is_apart = false;
  size_t fraction_digits = 0;
};

// Marks stand at the borders of fields, between all of a day's or a clock's or none.
std::optional<ClockLayout> ClockLayoutOf(const Runs& runs, size_t first, size_t end, bool has_day) {
  ClockLayout out{first, end, has_day};
  const size_t clock = has_day ? kDayDigits : 0, fraction = clock + kTimeDigits;
  size_t at = runs.digits[first].size();
  int in_day = 0, in_clock = 0;
  for (size_t i = first + 1; i < end; ++i) {
    if (at > fraction || at % 2 != 0 || (has_day && at == 2)) return std::nullopt;
    in_day += at < clock ? 1 : 0;
    in_clock += at > clock && at < fraction ? 1 : 0;
    out.fraction_is_apart |= at == fraction;
    at += runs.digits[i].size();
  }
  if (at < fraction || at > fraction + kMostFractionDigits) return std::nullopt;
  out.fraction_digits = at - fraction;
  out.has_marks = in_clock > 0;
  const bool is_even = (in_day == 0 || in_day == 2) && (in_clock == 0 || in_clock == 2);
  const bool is_apart = out.fraction_digits == 0 || out.fraction_is_apart;
  if (!is_even || (out.has_marks && !is_apart) || out.fraction_digits == 1) return std::nullopt;
  if (!is_apart && out.fraction_digits != kFrameDigits && out.fraction_digits % 3 != 0) return std::nullopt;
  return out;
}

int64_t NumberAt(const std::string& digits, size_t at, size_t count) {
  int64_t number = 0;
  return absl::SimpleAtoi(digits.substr(at, count), &number) ? number : 0;
}

// The digits of day and clock.
std::string DigitsOf(const Runs& runs, const ClockLayout& layout) {
  std::string out;
  for (size_t i = layout.first; i < layout.end; ++i) out += runs.digits[i];
  return out;
}

// In seconds since midnight, or since 1970.
std::optional<int64_t> SecondsOf(const std::string& digits, bool has_day) {
  int64_t day_s = 0;
  if (has_day) {
    constexpr int kFirstYear = 1990, kLastYear = 2099;
    const std::chrono::year_month_day day(std::chrono::year(static_cast<int>(NumberAt(digits, 0, 4))),
                                          std::chrono::month(static_cast<unsigned>(NumberAt(digits, 4, 2))),
                                          std::chrono::day(static_cast<unsigned>(NumberAt(digits, 6, 2))));
    const int year = static_cast<int>(day.year());
    if (!day.ok() || year < kFirstYear || year > kLastYear) return std::nullopt;
    constexpr int64_t kDay_s = 86'400;
    day_s = kDay_s * std::chrono::sys_days(day).time_since_epoch().count();
  }
  const size_t at = has_day ? kDayDigits : 0;
  const int64_t hour = NumberAt(digits, at, 2), minute = NumberAt(digits, at + 2, 2),
                second = NumberAt(digits, at + 4, 2);
  if (hour > 23 || minute > 59 || second > 59) return std::nullopt;
  return day_s + 3600 * hour + 60 * minute + second;
}

struct NamedReading {
  NameClocks clocks;
  ClockLayout layout;
  bool is_padded = false;  // zeros were missing
};

// How many units a second has: powers of ten, or the frames of a timecode. 0: neither.
int64_t UnitsInASecond(const std::vector<std::string>& digits, const ClockLayout& layout, int& timecode_fps) {
  int64_t units = 1;
  for (size_t i = 0; i < layout.fraction_digits; ++i) units *= 10;
  if (layout.fraction_digits != kFrameDigits) return units;
  int64_t most = 0;
  for (const std::string& one : digits)
    most = std::max(most, NumberAt(one, one.size() - kFrameDigits, kFrameDigits));
  constexpr std::array kRates = {24, 25, 30, 48, 50, 60};
  timecode_fps = static_cast<int>(most) + 1;
  return std::find(kRates.begin(), kRates.end(), timecode_fps) == kRates.end() ? 0 : timecode_fps;
}

std::optional<NamedReading> ReadAs(const std::vector<Runs>& names, const ClockLayout& layout) {
  NamedReading out{{}, layout};
  out.clocks.has_day = layout.has_day;
  std::vector<std::string> digits;
  for (const Runs& runs : names) digits.push_back(DigitsOf(runs, layout));
  const int64_t units = UnitsInASecond(digits, layout, out.clocks.timecode_fps);
  if (units == 0) return std::nullopt;
  out.clocks.unit_ns = kSecond_ns / units;
  for (const std::string& one : digits) {
    const std::optional<int64_t> second = SecondsOf(one, layout.has_day);
    if (!second) return std::nullopt;
    const int64_t part = NumberAt(one, one.size() - layout.fraction_digits, layout.fraction_digits);
    // No overflow: a part has 9 digits at most.
    const int64_t time_ns = *second * kSecond_ns + (part * kSecond_ns + units / 2) / units;
    if (!out.clocks.times_ns.empty() && time_ns <= out.clocks.times_ns.back()) return std::nullopt;
    out.clocks.times_ns.push_back(time_ns);
  }
  return out;
}

// The runs in which names differ; first behind end where there are none.
struct Span {
  size_t first = 0, end = 0;
};

Span DifferingRuns(const std::vector<Runs>& names) {
  const size_t runs = names.front().digits.size();
  Span out{runs, 0};
  for (size_t i = 0; i < runs; ++i) {
    const bool is_same = std::all_of(names.begin(), names.end(), [&](const Runs& one) {
      return one.digits[i] == names.front().digits[i];
    });
    if (is_same) continue;
    out.first = std::min(out.first, i);
    out.end = i + 1;
  }
  return out;
}

// With a day first, and of as few runs as can be first.
void AddReadings(const std::vector<Runs>& names, std::vector<NamedReading>& out) {
  if (!std::all_of(names.begin(), names.end(), [&](const Runs& one) { return AreAlike(one, names[0]); }))
    return;
  const size_t runs = names.front().digits.size();
  const Span differing = DifferingRuns(names);
  for (const bool has_day : {true, false}) {
    for (size_t first = std::min(differing.first + 1, runs); first-- > 0;) {
      for (size_t end = runs; end > first && end >= differing.end; --end) {
        const std::optional<ClockLayout> layout = ClockLayoutOf(names.front(), first, end, has_day);
        std::optional<NamedReading> reading = layout ? ReadAs(names, *layout) : std::nullopt;
        if (reading) out.push_back(*std::move(reading));
      }
    }
  }
}

// Numbers without leading zeros: 5:59.999 as 559999. Nothing where there are no such.
std::optional<NamedReading> ReadPadded(std::vector<Runs> names) {
  constexpr size_t kShortest = 5, kMilliseconds = kTimeDigits + 3;
  const Span differing = DifferingRuns(names);
  if (differing.end != differing.first + 1) return std::nullopt;
  size_t longest = 0, shortest = kMilliseconds;
  for (Runs& runs : names) {
    std::string& digits = runs.digits[differing.first];
    longest = std::max(longest, digits.size());
    shortest = std::min(shortest, digits.size());
    if (digits.size() < kMilliseconds) digits.insert(0, kMilliseconds - digits.size(), '0');
  }
  if (shortest == kMilliseconds || longest > kMilliseconds || longest < kShortest) return std::nullopt;
  const std::optional<ClockLayout> layout =
      ClockLayoutOf(names.front(), differing.first, differing.end, false);
  std::optional<NamedReading> reading = layout ? ReadAs(names, *layout) : std::nullopt;
  if (reading) reading->is_padded = true;
  return reading;
}

std::vector<NamedReading> ReadingsOf(const std::vector<std::string>& names) {
  std::vector<Runs> all;
  for (const std::string& name : names) {
    all.push_back(RunsOf(name));
    if (all.back().between != all.front().between) return {};
  }
  std::vector<NamedReading> out;
  if (all.empty() || all.front().digits.empty()) return out;
  AddReadings(all, out);
  if (std::optional<NamedReading> padded = ReadPadded(std::move(all))) out.push_back(*std::move(padded));
  return out;
}

int64_t UsualStep_ns(const std::vector<int64_t>& times_ns) {
  std::vector<int64_t> steps;
  for (size_t i = 1; i < times_ns.size(); ++i) steps.push_back(times_ns[i] - times_ns[i - 1]);
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>((steps.size() - 1) / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

// Somewhere a minute, or a second, ends between two frames that are one step apart.
bool GoesOver(int64_t border_ns, const std::vector<int64_t>& times_ns, int64_t usual_ns) {
  for (size_t i = 1; i < times_ns.size(); ++i) {
    const bool is_one_step = 2 * (times_ns[i] - times_ns[i - 1]) < 3 * usual_ns;
    if (is_one_step && times_ns[i] / border_ns > times_ns[i - 1] / border_ns) return true;
  }
  return false;
}

// Numbers would go on where clocks go over a border.
bool IsNoNumber(const NamedReading& reading) {
  constexpr int64_t kShortest_ns = 2'000'000, kLongest_ns = 1'100'000'000, kHour_ns = 60 * kMinute_ns;
  constexpr int64_t kLeftOut_ns = 40 * kSecond_ns;  // 60 to 99 seconds
  const std::vector<int64_t>& times_ns = reading.clocks.times_ns;
  const int64_t usual_ns = UsualStep_ns(times_ns);
  if (reading.clocks.timecode_fps > 0) return GoesOver(kSecond_ns, times_ns, usual_ns);
  if (2 * usual_ns < kLeftOut_ns && GoesOver(kMinute_ns, times_ns, usual_ns)) return true;
  const ClockLayout& layout = reading.layout;
  if (reading.is_padded || layout.fraction_digits == 0 || usual_ns < kShortest_ns || usual_ns > kLongest_ns)
    return false;
  // A number of its own may stand behind a clock that does not change.
  if (layout.fraction_is_apart && times_ns.back() / kSecond_ns == times_ns.front() / kSecond_ns) return false;
  return layout.has_day || layout.has_marks || times_ns.back() >= kHour_ns;
}

}  // namespace

std::optional<NameClocks> ReadNameClocks(const std::vector<std::string>& names) {
  if (std::optional<NameClocks> clocks = ClocksInNames(names)) return clocks;
  std::vector<NamedReading> readings = ReadingsOf(names);
  if (readings.empty()) return std::nullopt;
  return std::move(readings.front().clocks);
}

std::optional<NameClocks> ClocksInNames(const std::vector<std::string>& names) {
  if (names.size() < 2) return std::nullopt;
  for (NamedReading& reading : ReadingsOf(names))
    if (IsNoNumber(reading)) return std::move(reading.clocks);
  return std::nullopt;
}

}  // namespace weft
