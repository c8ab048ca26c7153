#include "services/studio/video/frame_times.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

#include "base/median.h"
#include "services/studio/video/timecode.h"

namespace weft {
namespace {

constexpr double kMostRounding =
    0.25;                          // of a period: coarser counts tell a late frame from a rounded one no more
constexpr double kExact_s = 1e-9;  // nothing was rounded
constexpr double kSlack = 1e-6;    // of a count, for sums of doubles
constexpr double kOfFit = 1.5;     // counts: a fitted line is off a little itself

// A line through times: frame `number[i]` of an even film at first_s + number[i] * period_s.
struct EvenFilm {
  double first_s = 0, period_s = 0;
  std::vector<int64_t> numbers;
  double scatter_s = 0;  // from the earliest to the latest
};

// Frames that are left out count.
std::vector<int64_t> NumbersOf(const std::vector<double>& times_s, double period_s) {
  std::vector<int64_t> numbers = {0};
  for (size_t i = 1; i < times_s.size(); ++i)
    numbers.push_back(numbers.back() +
                      std::max<int64_t>(1, std::llround((times_s[i] - times_s[i - 1]) / period_s)));
  return numbers;
}

EvenFilm LineOf(const std::vector<double>& times_s, double period_s, std::vector<int64_t> numbers) {
  EvenFilm film{0, period_s, std::move(numbers)};
  double earliest_s = INFINITY, latest_s = -INFINITY;
  for (size_t i = 0; i < times_s.size(); ++i) {
    const double first_s = times_s[i] - period_s * static_cast<double>(film.numbers[i]);
    earliest_s = std::min(earliest_s, first_s);
    latest_s = std::max(latest_s, first_s);
  }
  film.first_s = (earliest_s + latest_s) / 2;
  film.scatter_s = latest_s - earliest_s;
  return film;
}

double SlopeOf(const std::vector<double>& times_s, const std::vector<int64_t>& numbers) {
  const auto count = static_cast<double>(times_s.size());
  double mean_number = 0, mean_s = 0, together = 0, alone = 0;
  for (size_t i = 0; i < times_s.size(); ++i) {
    mean_number += static_cast<double>(numbers[i]) / count;
    mean_s += times_s[i] / count;
  }
  for (size_t i = 0; i < times_s.size(); ++i) {
    const double number = static_cast<double>(numbers[i]) - mean_number;
    together += number * (times_s[i] - mean_s);
    alone += number * number;
  }
  return together / alone;
}

// Nothing where the times are no rounded ones of an even film.
std::optional<EvenFilm> EvenFilmOf(const std::vector<double>& times_s, double count_s, double declared_fps) {
  const double about_s = Period_s(times_s);
  if (about_s <= 0) return std::nullopt;
  const double rounding_s = std::min(count_s, kMostRounding * about_s) + kSlack * count_s;
  // Twice: the middle distance is rounded, and numbers after a long gap need more.
  double slope_s = SlopeOf(times_s, NumbersOf(times_s, about_s));
  if (!(slope_s > 0)) return std::nullopt;
  const std::vector<int64_t> numbers = NumbersOf(times_s, slope_s);
  slope_s = SlopeOf(times_s, numbers);
  if (!(slope_s > 0)) return std::nullopt;
  std::vector<double> rates = {declared_fps};
  if (const auto rate = StandardRate(1 / slope_s)) rates.push_back(rate->fps());
  for (const double fps : rates) {
    if (fps <= 0) continue;
    EvenFilm film = LineOf(times_s, 1 / fps, numbers);
    if (film.scatter_s <= rounding_s) return film;
  }
  EvenFilm film = LineOf(times_s, slope_s, numbers);
  if (film.scatter_s <= kOfFit * rounding_s) return film;
  return std::nullopt;
}

}  // namespace

std::vector<double> FrameTimes_s(const v1::VideoFacts& facts) {
  const double count_s =
      static_cast<double>(facts.time_base_num()) / static_cast<double>(facts.time_base_den());
  std::vector<double> times_s;
  for (const int64_t pts : facts.frame_pts()) times_s.push_back(count_s * static_cast<double>(pts));
  const auto film = EvenFilmOf(times_s, count_s, facts.declared_fps());
  if (!film || film->scatter_s < kExact_s) return times_s;
  for (size_t i = 0; i < times_s.size(); ++i)
    times_s[i] = film->first_s + film->period_s * static_cast<double>(film->numbers[i]);
  return times_s;
}

double BeginTime_s(const v1::VideoFacts& facts) {
  if (facts.frame_pts().empty()) return 0;
  const double count_s =
      static_cast<double>(facts.time_base_num()) / static_cast<double>(facts.time_base_den());
  return FrameTimes_s(facts).front() - count_s * static_cast<double>(facts.frame_pts(0) - facts.begin_pts());
}

double Period_s(const v1::VideoFacts& facts) { return Period_s(FrameTimes_s(facts)); }

double Period_s(const std::vector<double>& times_s) {
  std::vector<double> periods_s;
  for (size_t i = 1; i < times_s.size(); ++i) periods_s.push_back(times_s[i] - times_s[i - 1]);
  return periods_s.empty() ? 0 : Median(std::move(periods_s));
}

}  // namespace weft
