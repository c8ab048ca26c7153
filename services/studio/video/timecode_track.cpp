#include "services/studio/video/timecode_track.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/studio/video/frame_times.h"
#include "services/studio/video/video_program.h"

namespace weft {
namespace {

constexpr double kFar = 0.02;  // of a whole number of frames a second: no phone is as far off
constexpr int64_t kDropsFlag = 1;
constexpr size_t kRowOfDump = 16;  // bytes

// Bytes of the dump "00000000: 0011 195a   ...Z", of as many rows as it has.
std::string BytesOfDump(const std::string& dump) {
  std::string bytes;
  for (size_t at = 0;; at += kRowOfDump) {
    const size_t row = dump.find(absl::StrCat(absl::Hex(at, absl::kZeroPad8), ": "));
    if (row == std::string::npos) return bytes;
    const size_t first = row + 10;
    // Two bytes, a blank, two bytes, ...; the letters follow after more blanks.
    for (size_t digit = first, i = 0; i < kRowOfDump && digit + 1 < dump.size();
         ++i, digit += i % 2 == 0 ? 3 : 2) {
      int value = 0;
      if (!absl::SimpleHexAtoi(dump.substr(digit, 2), &value)) break;
      bytes.push_back(static_cast<char>(value));
    }
  }
}

// Big endian; `at` is within `bytes`.
int64_t UnsignedAt(const std::string& bytes, size_t at, size_t size) {
  int64_t number = 0;
  for (size_t i = 0; i < size; ++i) number = 256 * number + static_cast<unsigned char>(bytes[at + i]);
  return number;
}

// What stands in the track's description (QuickTime File Format, timecode sample description).
struct TrackDescription {
  bool drops = false;
  double fps = 0;       // time scale over duration of a frame
  int nominal_fps = 0;  // numbers that a second has
};

absl::StatusOr<TrackDescription> DescriptionIn(const std::string& bytes) {
  if (bytes.size() < 17) return absl::NotFoundError("its timecode track is not described");
  TrackDescription track;
  track.drops = (UnsignedAt(bytes, 4, 4) & kDropsFlag) != 0;
  const int64_t scale = UnsignedAt(bytes, 8, 4), duration = UnsignedAt(bytes, 12, 4);
  track.nominal_fps = static_cast<int>(UnsignedAt(bytes, 16, 1));
  if (scale <= 0 || duration <= 0) return absl::NotFoundError("its timecode track has no rate");
  track.fps = static_cast<double>(scale) / static_cast<double>(duration);
  if (track.nominal_fps == 0) track.nominal_fps = static_cast<int>(std::lround(std::min(track.fps, 1e3)));
  return track;
}

// Of the film: what its frames' times say goes before what its header says, which is often a mean.
std::optional<TimecodeRate> FilmRate(const v1::VideoFacts& facts) {
  const double period_s = Period_s(facts);
  for (const double fps : {period_s > 0 ? 1 / period_s : 0, facts.declared_fps()})
    if (const auto rate = StandardRate(fps)) return rate;
  return std::nullopt;
}

struct KnownRate {
  TimecodeRate rate;
  bool is_sure = false;
};

// A nominal rate of 0: unknown.
KnownRate RateBy(const v1::VideoFacts& facts) {
  const std::optional<TimecodeRate> of_track = StandardRate(facts.timecode_fps());
  if (of_track && facts.is_timecode_fps_sure()) return {*of_track, true};
  const std::optional<TimecodeRate> of_film = FilmRate(facts);
  const double period_s = Period_s(facts);
  double about = facts.timecode_fps();
  if (about <= 0) about = of_film ? of_film->fps() : period_s > 0 ? 1 / period_s : facts.declared_fps();
  const auto nominal = static_cast<int>(std::lround(std::min(about, 1e3)));
  if (nominal <= 0 || std::abs(about - nominal) > kFar * nominal) return {};
  // A track of 30 in a film of 59.94 counts 29.97: both are slow, or none is.
  if (of_film) return {{nominal, of_film->is_slow}, true};
  return {{nominal, std::abs(about - nominal) > std::abs(about - nominal * 1000.0 / 1001)}, false};
}

}  // namespace

int TimecodeTrackOf(const FlatValues& header) {
  constexpr int kMostStreams = 64;
  std::string named;
  int first = -1;
  for (int i = 0; i < kMostStreams && named.empty(); ++i) {
    const std::string stream = absl::StrCat("streams.stream.", i, ".");
    if (ValueOf(header, stream + "codec_type") == "video") named = ValueOf(header, stream + "tags.timecode");
  }
  for (int i = 0; i < kMostStreams; ++i) {
    const std::string stream = absl::StrCat("streams.stream.", i, ".");
    if (ValueOf(header, stream + "codec_tag_string") != "tmcd") continue;
    if (first < 0) first = i;
    if (!named.empty() && ValueOf(header, stream + "tags.timecode") == named) return i;
  }
  return first;
}

absl::Status ParseTimecodeTrack(std::string_view flat, v1::VideoFacts& facts) {
  const FlatValues values = ValuesOf(flat);
  WEFT_ASSIGN_OR_RETURN(const TrackDescription track,
                        DescriptionIn(BytesOfDump(ValueOf(values, "streams.stream.0.extradata"))));
  const auto base = FractionOf(ValueOf(values, "streams.stream.0.time_base"));
  const std::string sample = BytesOfDump(ValueOf(values, "packets.packet.0.data"));
  int64_t pts = 0;
  if (!base || sample.size() != 4 || !absl::SimpleAtoi(ValueOf(values, "packets.packet.0.pts"), &pts))
    return absl::NotFoundError("its timecode track is empty");
  // A rate that is not exact is a mean; then the number of labels a second alone is of use.
  const std::optional<TimecodeRate> rate = StandardRate(track.fps, kWrittenExactly);
  Timecode like;
  like.nominal_fps = track.nominal_fps;
  like.drops = track.drops;
  like.fps = TimecodeRate{track.nominal_fps, rate && rate->is_slow}.fps();
  if (like.nominal_fps <= 0 || like.nominal_fps > kMostTimecodeFps ||
      (like.drops && like.nominal_fps % 30 != 0))
    return absl::InvalidArgumentError("its timecode track counts at a rate that timecode does not have");
  // Numbers before midnight are negative.
  facts.set_timecode(TimecodeText(TimecodeOf(static_cast<int32_t>(UnsignedAt(sample, 0, 4)), like)));
  facts.set_timecode_fps(like.fps);
  facts.set_is_timecode_fps_sure(rate.has_value());
  facts.set_timecode_at_s(static_cast<double>(pts) * static_cast<double>(base->first) /
                          static_cast<double>(base->second));
  return absl::OkStatus();
}

absl::Status ReadTimecodeTrack(int index, v1::VideoFacts& facts) {
  // ffmpeg's full edit lists lose when a sample began that they cut; the plain ones move the track as a
  // whole.
  const auto said = RunVideoProgram(
      "ffprobe", facts.path(),
      {"-hide_banner", "-v", "error", "-protocol_whitelist", "file", "-advanced_editlist", "0",
       "-select_streams", absl::StrCat(index), "-read_intervals", "%+4", "-show_data", "-show_entries",
       "stream=time_base,extradata:packet=pts,data", "-of", "flat", absl::StrCat("file:", facts.path())});
  return said.ok() ? ParseTimecodeTrack(said->out, facts) : said.status();
}

std::vector<double> TimecodeRates(const std::vector<v1::VideoFacts>& videos) {
  std::vector<KnownRate> known;
  size_t slow = 0, sure = 0;
  for (const v1::VideoFacts& video : videos) {
    known.push_back(RateBy(video));
    sure += known.back().is_sure;
    slow += known.back().is_sure && known.back().rate.is_slow;
  }
  const bool all_alike = sure > 0 && (slow == 0 || slow == sure);
  std::vector<double> rates;
  for (KnownRate& one : known) {
    if (!one.is_sure && all_alike) one.rate.is_slow = slow == sure;
    if (!one.is_sure && sure == 0) one.rate.is_slow = known.front().rate.is_slow;
    rates.push_back(one.rate.fps());
  }
  return rates;
}

absl::StatusOr<TimecodeAt> LabelOf(const v1::VideoFacts& facts, double fps) {
  if (facts.timecode().empty()) return absl::NotFoundError(absl::StrCat(facts.path(), ": has no timecode"));
  const absl::StatusOr<Timecode> timecode = ParseTimecode(facts.timecode(), fps);
  if (timecode.ok()) return TimecodeAt{*timecode, facts.timecode_at_s()};
  return absl::InvalidArgumentError(absl::StrCat(facts.path(), ": ", timecode.status().message()));
}

absl::StatusOr<Timecode> TimecodeOfFirst(const v1::VideoFacts& facts) {
  WEFT_ASSIGN_OR_RETURN(const TimecodeAt label, LabelOf(facts, TimecodeRates({facts}).front()));
  const std::vector<double> times_s = FrameTimes_s(facts);
  const double since_s = times_s.empty() ? 0 : times_s.front() - label.at_s;
  return TimecodeOf(label.timecode.Number() + std::llround(since_s * label.timecode.fps), label.timecode);
}

}  // namespace weft
