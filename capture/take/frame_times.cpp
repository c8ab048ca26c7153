#include "capture/take/frame_times.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/status_macros.h"
#include "capture/take/name_clocks.h"
#include "capture/take/name_counts.h"

namespace weft {
namespace {

struct Unit {
  const char* name;
  int64_t ns;
};
constexpr Unit kSecond = {"s", 1'000'000'000}, kMillisecond = {"ms", 1'000'000};
constexpr Unit kUnits[] = {kSecond, kMillisecond, {"us", 1'000}, {"ns", 1}};

// From 2000 to 2100. Ranges of the units do not meet.
bool IsSince1970(const NameCounts& count, int64_t unit_ns) {
  constexpr int64_t kFirst_s = 946'684'800, kLast_s = 4'102'444'800;
  const int64_t per_second = kSecond.ns / unit_ns;
  return count.values.front() / per_second >= kFirst_s && count.values.back() / per_second < kLast_s;
}

double Period_ns(const NameCounts& count, int64_t unit_ns) {
  return count.usual_step * static_cast<double>(unit_ns);
}

// Whether frames come every period of `fps`, or every few of them.
bool FitsRate(double period_ns, double fps, int64_t most_periods) {
  constexpr double kOff = 0.02;
  const double periods = period_ns * fps * 1e-9, whole = std::round(periods);
  return whole >= 1 && whole <= static_cast<double>(most_periods) && std::abs(periods - whole) < kOff * whole;
}

// Numbers of frames step by less than a thousand, and stay below ten years of film; us and ns do not.
bool IsFine(const NameCounts& count, const Unit& unit) {
  constexpr double kShortest_ns = 2e6, kLongest_ns = 1.1e9;
  constexpr int64_t kCoarsest_ns = 1'000, kBeyondFilms = 10'000'000'000;
  const double period_ns = Period_ns(count, unit.ns);
  return unit.ns <= kCoarsest_ns && period_ns >= kShortest_ns && period_ns <= kLongest_ns &&
         (AreRegular(count) || count.values.back() >= kBeyondFilms);
}

// Of films and cameras; by 1.001 as television has them.
bool IsUsualRate(double fps, double relative_off) {
  constexpr std::array kRates = {5.0,  6.0,  7.5,  10.0, 12.0, 12.5,  15.0,  20.0,  24.0,  25.0, 30.0,
                                 48.0, 50.0, 60.0, 72.0, 90.0, 100.0, 120.0, 144.0, 150.0, 240.0};
  constexpr double kTelevision = 1.001;
  return std::any_of(kRates.begin(), kRates.end(), [&](double rate) {
    return std::abs(fps / rate - 1) < relative_off || std::abs(fps * kTelevision / rate - 1) < relative_off;
  });
}

// ms without a rate that vouches for them. Frames that were picked evenly from many have uneven steps, too,
// but the rate of a camera only by chance, and the less the more they are.
bool AreRoundedMs(const NameCounts& count) {
  constexpr size_t kFewest = 6;
  constexpr double kShortest_ms = 4, kMostOff_ms = 2, kClockOff = 5e-4, kMostUnsure = 0.02;
  if (count.values.size() < kFewest || count.usual_step < kShortest_ms || !AreRegular(count) ||
      !AreUneven(count))
    return false;
  const LineFit fit = FitLine(count);
  const double span_ms = static_cast<double>(count.values.back() - count.values.front());
  const double relative_off = kClockOff + 2 * std::max(0.5, fit.worst) / span_ms;
  return fit.worst < kMostOff_ms && relative_off < kMostUnsure && IsUsualRate(1e3 / fit.period, relative_off);
}

// What numbers are, where they are times.
struct Reading {
  NameCounts counts;
  int64_t unit_ns = 0;
  std::string words;
};

std::optional<Reading> ReadCounts(const NameCounts& count, double fps) {
  if (count.has_fraction) {
    const bool since = IsSince1970(count, count.fraction_ns);
    return Reading{count, count.fraction_ns, since ? "times in s since 1970" : "times in s"};
  }
  for (const Unit& unit : kUnits) {
    // Whole seconds are numbers of frames as well, unless the rate says otherwise.
    const bool is_told = unit.ns < kSecond.ns || FitsRate(Period_ns(count, unit.ns), fps, 1);
    if (is_told && IsSince1970(count, unit.ns))
      return Reading{count, unit.ns, absl::StrCat("times in ", unit.name, " since 1970")};
  }
  for (const Unit& unit : kUnits) {
    const bool fits = unit.ns < kSecond.ns && count.usual_step > 1 && AreRegular(count) &&
                      FitsRate(Period_ns(count, unit.ns), fps, 1);
    if (IsFine(count, unit) || fits) return Reading{count, unit.ns, absl::StrCat("times in ", unit.name)};
  }
  if (fps == 0 && AreRoundedMs(count)) return Reading{count, kMillisecond.ns, "times in ms"};
  return std::nullopt;
}

absl::StatusOr<Reading> ReadClocks(const NameClocks& clocks, const std::vector<std::string>& names) {
  Reading out{{clocks.times_ns}, 1, "times of day"};
  if (clocks.timecode_fps > 0)
    out.words = absl::StrCat("timecode of ", clocks.timecode_fps, " frames a second");
  if (clocks.has_day) absl::StrAppend(&out.words, " with their day");
  constexpr int64_t kHalfDay_ns = 43'200 * kSecond.ns;
  std::vector<int64_t> steps;
  for (size_t i = 1; i < clocks.times_ns.size(); ++i) {
    steps.push_back(clocks.times_ns[i] - clocks.times_ns[i - 1]);
    if (clocks.has_day || steps.back() < kHalfDay_ns) continue;
    return absl::InvalidArgumentError(absl::StrCat(
        "names of frames: ", names[i - 1], " and ", names[i],
        " are times of day, half a day apart; a take that goes over midnight has its end first. Put the day "
        "before the clock, 20250131_235959999, or give --names numbers where they are no clocks"));
  }
  if (!steps.empty()) out.counts.usual_step = UsualStep(steps);
  return out;
}

absl::Status NotAs(NameMeaning meaning, const std::vector<std::string>& names) {
  const std::string range = names.empty() ? "" : absl::StrCat(names.front(), " to ", names.back());
  return absl::InvalidArgumentError(absl::StrCat(
      "names of frames: ", range,
      meaning == NameMeaning::kClock
          ? " are no clocks that rise, HHMMSSmmm or HH-MM-SS.mmm, with or without YYYYMMDD before them"
          : " do not differ in one whole number that rises"));
}

// Nothing where names are no times.
absl::StatusOr<std::optional<Reading>> ReadTimes(const std::vector<std::string>& names, double fps) {
  if (const std::optional<NameClocks> clocks = ClocksInNames(names)) return ReadClocks(*clocks, names);
  WEFT_ASSIGN_OR_RETURN(const std::optional<NameCounts> count, CountsInNames(names));
  return count ? ReadCounts(*count, fps) : std::nullopt;
}

absl::StatusOr<std::optional<Reading>> ReadTimesAs(const std::vector<std::string>& names,
                                                   NameMeaning meaning) {
  if (meaning == NameMeaning::kClock) {
    const std::optional<NameClocks> clocks = ReadNameClocks(names);
    if (!clocks) return NotAs(meaning, names);
    return ReadClocks(*clocks, names);
  }
  WEFT_ASSIGN_OR_RETURN(const std::optional<NameCounts> count, CountsInNames(names));
  if (!count || (count->has_fraction && meaning != NameMeaning::kSeconds)) return NotAs(meaning, names);
  const Unit& unit = kUnits[static_cast<size_t>(meaning) - static_cast<size_t>(NameMeaning::kSeconds)];
  const int64_t unit_ns = count->has_fraction ? count->fraction_ns : unit.ns;
  return Reading{*count, unit_ns, absl::StrCat("times in ", unit.name)};
}

// In steps of `step_ns` from `first_ns` behind the first time, rising by one at least.
std::vector<uint64_t> NumbersOf(const std::vector<int64_t>& times_ns, double step_ns, double first_ns) {
  std::vector<uint64_t> numbers;
  for (const int64_t time_ns : times_ns) {
    const double since_first_ns = static_cast<double>(time_ns - times_ns.front()) - first_ns;
    const double steps = std::max(0.0, std::round(since_first_ns / step_ns));
    const uint64_t next = numbers.empty() ? 0 : numbers.back() + 1;
    numbers.push_back(std::max(next, static_cast<uint64_t>(steps)));
  }
  return numbers;
}

constexpr std::pair<NameMeaning, std::string_view> kMeanings[] = {
    {NameMeaning::kAuto, "auto"},       {NameMeaning::kNumbers, "numbers"}, {NameMeaning::kSeconds, "s"},
    {NameMeaning::kMilliseconds, "ms"}, {NameMeaning::kMicroseconds, "us"}, {NameMeaning::kNanoseconds, "ns"},
    {NameMeaning::kClock, "clock"}};

}  // namespace

absl::StatusOr<NameMeaning> NameMeaningFromName(std::string_view name) {
  for (const auto& [meaning, known] : kMeanings)
    if (known == name) return meaning;
  return absl::InvalidArgumentError(
      absl::StrCat("names: \"", std::string(name), "\" is none of auto, numbers, s, ms, us, ns, clock"));
}

absl::StatusOr<std::optional<FrameTimes>> TimesInNames(const std::vector<std::string>& names, double fps,
                                                       NameMeaning meaning) {
  if (meaning == NameMeaning::kNumbers) return std::nullopt;
  WEFT_ASSIGN_OR_RETURN(const std::optional<Reading> reading,
                        meaning == NameMeaning::kAuto ? ReadTimes(names, fps) : ReadTimesAs(names, meaning));
  if (!reading) return std::nullopt;
  const auto& [counts, unit_ns, words] = *reading;
  // Of 64 bits of ns: 292 years.
  if (counts.values.back() > INT64_MAX / unit_ns) {
    if (meaning == NameMeaning::kAuto) return std::nullopt;
    return absl::InvalidArgumentError(
        absl::StrCat("names of frames: as ", words, ", ", names.back(), " is later than 292 years"));
  }
  FrameTimes times;
  times.words = words;
  const LineFit fit = AreRegular(counts) ? FitLine(counts) : LineFit{0, counts.usual_step};
  const double unit = static_cast<double>(unit_ns), period_ns = fit.period * unit;
  if (period_ns > 0) absl::StrAppendFormat(&times.words, ", usually %.3f ms apart", period_ns * 1e-6);
  constexpr int64_t kMostPeriods = 1000;
  if (fps > 0 && period_ns > 0 && !FitsRate(period_ns, fps, kMostPeriods)) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "fps: the names of the frames are %s, and %g frames a second are %.3f ms apart; leave "
        "the rate out, or give --names numbers where they are no times",
        times.words, fps, 1e3 / fps));
  }
  for (const int64_t value : counts.values) times.times_ns.push_back(value * unit_ns);
  const double step_ns = fps > 0 ? 1e9 / fps : std::max(period_ns, 1.0);
  times.numbers = NumbersOf(times.times_ns, step_ns, fit.first * unit);
  return times;
}

std::string DoubtOfNumbers(const std::vector<std::string>& names) {
  constexpr double kLeastStep = 4;  // of ms, at 250 frames a second
  const absl::StatusOr<std::optional<NameCounts>> count = CountsInNames(names);
  constexpr size_t kFewest = 3;  // two numbers have no usual step
  if (names.size() < kFewest || !count.ok() || !*count || (*count)->usual_step < kLeastStep) return "";
  return absl::StrFormat(
      "names of frames are taken as numbers, which usually rise by %.9g; where they are times, say in which "
      "unit with --names s, ms, us, ns or clock",
      (*count)->usual_step);
}

}  // namespace weft
