#include "services/studio/video/timecode.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "capture/file/plain_text.h"

namespace weft {
namespace {

constexpr double kOffNominal = 0.005;  // 29.97 is off by 0.001

// Left out each minute that is no tenth.
int64_t DroppedPerMinute(const Timecode& timecode) {
  return timecode.drops ? 2 * (timecode.nominal_fps / 30) : 0;
}

int64_t FramesOfTenMinutes(const Timecode& timecode) {
  return int64_t{600} * timecode.nominal_fps - 9 * DroppedPerMinute(timecode);
}

// The number in front of `text`, of `least` to `most` digits, which it then lacks; -1: there is none.
int TakeNumber(std::string_view& text, size_t least, size_t most) {
  size_t digits = 0;
  int number = 0;
  while (digits < std::min(most, text.size()) && text[digits] >= '0' && text[digits] <= '9')
    number = 10 * number + text[digits++] - '0';
  if (digits < least) return -1;
  text.remove_prefix(digits);
  return number;
}

// Whether one of `separators` is in front of `text`; it is gone then, and in `found`.
bool TakeSeparator(std::string_view& text, std::string_view separators, char& found) {
  if (text.empty() || separators.find(text.front()) == std::string_view::npos) return false;
  found = text.front();
  text.remove_prefix(1);
  return true;
}

// Its numbers, and whether it drops some; false: it is no timecode.
bool SplitTimecode(std::string_view text, Timecode& timecode) {
  char colon = ':', last = ':';
  timecode.hours = TakeNumber(text, 2, 5);
  const bool has_minutes = TakeSeparator(text, ":", colon);
  timecode.minutes = TakeNumber(text, 2, 2);
  const bool has_seconds = TakeSeparator(text, ":", colon);
  timecode.seconds = TakeNumber(text, 2, 2);
  const bool has_frames = TakeSeparator(text, ":;.,", last);
  timecode.frames = TakeNumber(text, 1, 3);
  timecode.drops = last != ':';
  return has_minutes && has_seconds && has_frames && text.empty() && timecode.hours >= 0 &&
         timecode.minutes >= 0 && timecode.seconds >= 0 && timecode.frames >= 0;
}

absl::Status Wrong(std::string_view text, const char* why) {
  return absl::InvalidArgumentError(
      absl::StrCat("the timecode \"", EscapedText(text.substr(0, 40)), "\" ", why));
}

}  // namespace

int64_t Timecode::Number() const {
  const int64_t all_minutes = int64_t{60} * hours + minutes;
  return (all_minutes * 60 + seconds) * nominal_fps + frames -
         DroppedPerMinute(*this) * (all_minutes - all_minutes / 10);
}

double Timecode::Day_s() const { return static_cast<double>(144 * FramesOfTenMinutes(*this)) / fps; }

std::optional<TimecodeRate> StandardRate(double fps, double within) {
  if (!(fps > 0.5 && fps < kMostTimecodeFps + 0.5)) return std::nullopt;
  const auto nominal = static_cast<int>(std::lround(fps));
  for (const bool is_slow : {false, true}) {
    const TimecodeRate rate{nominal, is_slow};
    if (std::abs(fps - rate.fps()) <= within * rate.fps()) return rate;
  }
  return std::nullopt;
}

absl::StatusOr<Timecode> ParseTimecode(std::string_view text, double fps) {
  Timecode timecode;
  timecode.fps = fps;
  timecode.nominal_fps = fps > 0.5 && fps < kMostTimecodeFps + 0.5 ? static_cast<int>(std::lround(fps)) : 0;
  const bool is_before_midnight = !text.empty() && text.front() == '-';
  if (!SplitTimecode(text.substr(is_before_midnight ? 1 : 0), timecode))
    return Wrong(text, "is not HH:MM:SS:FF");
  if (timecode.nominal_fps == 0 || std::abs(fps - timecode.nominal_fps) > kOffNominal * timecode.nominal_fps)
    return Wrong(text, "counts whole frames a second, and the film has no such rate");
  if (timecode.minutes >= 60 || timecode.seconds >= 60) return Wrong(text, "is no time of a day");
  if (timecode.frames >= timecode.nominal_fps) return Wrong(text, "has more frames than the film a second");
  if (timecode.drops && timecode.nominal_fps % 30 != 0)
    return Wrong(text, "drops frame numbers, which 29.97 and 59.94 frames a second alone do");
  if (timecode.drops && timecode.seconds == 0 && timecode.minutes % 10 != 0 &&
      timecode.frames < DroppedPerMinute(timecode))
    return Wrong(text, "is one of those that are dropped");
  const int64_t number = timecode.Number();
  return TimecodeOf(is_before_midnight ? -number : number, timecode);
}

std::string TimecodeText(const Timecode& timecode) {
  return absl::StrFormat("%02d:%02d:%02d%c%02d", timecode.hours, timecode.minutes, timecode.seconds,
                         timecode.drops ? ';' : ':', timecode.frames);
}

Timecode TimecodeOf(int64_t number, const Timecode& like) {
  Timecode timecode = like;
  const int64_t ten_minutes = FramesOfTenMinutes(like), day = 144 * ten_minutes;
  number = ((number % day) + day) % day;
  // Numbers that are left out, put back in: then it counts evenly.
  const int64_t dropped = DroppedPerMinute(like), minute = int64_t{60} * like.nominal_fps - dropped;
  const int64_t tens = number / ten_minutes, rest = number % ten_minutes;
  const int64_t after_first = rest - int64_t{60} * like.nominal_fps;
  const int64_t minutes_begun = dropped > 0 && after_first >= 0 ? after_first / minute + 1 : 0;
  const int64_t even = number + dropped * (9 * tens + minutes_begun);
  timecode.frames = static_cast<int>(even % like.nominal_fps);
  const int64_t all_seconds = even / like.nominal_fps;
  timecode.seconds = static_cast<int>(all_seconds % 60);
  timecode.minutes = static_cast<int>(all_seconds / 60 % 60);
  timecode.hours = static_cast<int>(all_seconds / 3600);
  return timecode;
}

}  // namespace weft
