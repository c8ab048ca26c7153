#include "services/video/timecode.h"

#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "capture/file/plain_text.h"

namespace weft {
namespace {

constexpr int kMostFps = 240;
constexpr double kOffNominal = 0.005;  // 29.97 is off by 0.001
constexpr size_t kLength = 11;         // HH:MM:SS:FF

// Left out each minute that is no tenth.
int64_t DroppedPerMinute(const Timecode& timecode) {
  return timecode.drops ? 2 * (timecode.nominal_fps / 30) : 0;
}

int64_t FramesOfTenMinutes(const Timecode& timecode) {
  return int64_t{600} * timecode.nominal_fps - 9 * DroppedPerMinute(timecode);
}

// -1 where they are no digits.
int TwoDigits(std::string_view text, size_t at) {
  const char a = text[at], b = text[at + 1];
  return a >= '0' && a <= '9' && b >= '0' && b <= '9' ? 10 * (a - '0') + b - '0' : -1;
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

absl::StatusOr<Timecode> ParseTimecode(std::string_view text, double fps) {
  if (text.size() != kLength || text[2] != ':' || text[5] != ':' ||
      std::string_view(":;.").find(text[8]) == std::string_view::npos)
    return Wrong(text, "is not HH:MM:SS:FF");
  Timecode timecode;
  timecode.fps = fps;
  timecode.nominal_fps = fps > 0.5 && fps < kMostFps + 0.5 ? static_cast<int>(std::lround(fps)) : 0;
  if (timecode.nominal_fps == 0 || std::abs(fps - timecode.nominal_fps) > kOffNominal * timecode.nominal_fps)
    return Wrong(text, "counts whole frames a second, and the film has no such rate");
  timecode.hours = TwoDigits(text, 0);
  timecode.minutes = TwoDigits(text, 3);
  timecode.seconds = TwoDigits(text, 6);
  timecode.frames = TwoDigits(text, 9);
  timecode.drops = text[8] != ':';
  for (const int part : {timecode.hours, timecode.minutes, timecode.seconds, timecode.frames})
    if (part < 0) return Wrong(text, "is not HH:MM:SS:FF");
  if (timecode.hours >= 24 || timecode.minutes >= 60 || timecode.seconds >= 60)
    return Wrong(text, "is no time of a day");
  if (timecode.frames >= timecode.nominal_fps) return Wrong(text, "has more frames than the film a second");
  if (timecode.drops && timecode.nominal_fps % 30 != 0)
    return Wrong(text, "drops frame numbers, which 29.97 and 59.94 frames a second alone do");
  if (timecode.drops && timecode.seconds == 0 && timecode.minutes % 10 != 0 &&
      timecode.frames < DroppedPerMinute(timecode))
    return Wrong(text, "is one of those that are dropped");
  return timecode;
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
