#include "services/studio/video/ltc.h"

#include <ltc.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/median.h"
#include "base/status_macros.h"
#include "services/studio/video/camera_offsets.h"
#include "services/studio/video/frame_times.h"
#include "services/studio/video/video_facts.h"
#include "services/studio/video/video_program.h"

namespace weft {
namespace {

constexpr int kRate_hz = 48000;
constexpr int kMostChannels = 16;

constexpr double kLeast_s = 0.5;        // of timecode in order
constexpr double kLeastSigma_s = 1e-4;  // sound and picture of a camera are hardly closer
constexpr double kTelling = 1.4826;     // of a normal distribution: sigma over the median deviation
constexpr size_t kPiece = 1024;         // samples

struct LtcFrameAt {
  SMPTETimecode text;
  bool drops;
  double first_s, last_s;
};

std::vector<LtcFrameAt> FramesIn(const std::vector<int16_t>& samples, double rate_hz) {
  const std::unique_ptr<LTCDecoder, int (*)(LTCDecoder*)> decoder(
      ltc_decoder_create(static_cast<int>(rate_hz / 25), 32), &ltc_decoder_free);
  std::vector<LtcFrameAt> frames;
  std::vector<int16_t> piece;
  for (size_t at = 0; decoder && at < samples.size(); at += kPiece) {
    const size_t size = std::min(kPiece, samples.size() - at);
    piece.assign(samples.begin() + static_cast<std::ptrdiff_t>(at),
                 samples.begin() + static_cast<std::ptrdiff_t>(at + size));
    ltc_decoder_write_s16(decoder.get(), piece.data(), size, static_cast<ltc_off_t>(at));
    LTCFrameExt frame;
    while (ltc_decoder_read(decoder.get(), &frame) > 0) {
      if (frame.reverse != 0) continue;
      LtcFrameAt& read = frames.emplace_back();
      ltc_frame_to_time(&read.text, &frame.ltc, 0);
      read.drops = frame.ltc.dfbit != 0;
      read.first_s = static_cast<double>(frame.off_start) / rate_hz;
      read.last_s = static_cast<double>(frame.off_end) / rate_hz;
    }
  }
  return frames;
}

double PeriodOfFrames(const std::vector<LtcFrameAt>& frames) {
  std::vector<double> lengths_s;
  for (const LtcFrameAt& frame : frames) lengths_s.push_back(frame.last_s - frame.first_s);
  return Median(std::move(lengths_s));
}

// Nothing where the bits make no timecode.
std::optional<Timecode> TimecodeIn(const LtcFrameAt& frame, int nominal_fps) {
  Timecode timecode;
  timecode.hours = frame.text.hours;
  timecode.minutes = frame.text.mins;
  timecode.seconds = frame.text.secs;
  timecode.frames = frame.text.frame;
  timecode.drops = frame.drops;
  timecode.nominal_fps = nominal_fps;
  timecode.fps = nominal_fps;
  const auto checked = ParseTimecode(TimecodeText(timecode), nominal_fps);
  return checked.ok() ? std::optional(*checked) : std::nullopt;
}

// Numbers and times of frames whose number fits their time, against the middle one.
struct InOrder {
  std::vector<int64_t> numbers;
  std::vector<double> times_s;
};

InOrder KeepThoseInOrder(const std::vector<LtcFrameAt>& frames, int nominal_fps) {
  std::vector<std::pair<int64_t, double>> read;
  std::vector<double> starts_s;  // of frame 0 of the day
  for (const LtcFrameAt& frame : frames) {
    const std::optional<Timecode> timecode = TimecodeIn(frame, nominal_fps);
    if (!timecode) continue;
    read.emplace_back(timecode->Number(), frame.first_s);
    starts_s.push_back(frame.first_s - timecode->Seconds());
  }
  InOrder kept;
  if (read.empty()) return kept;
  const double start_s = Median(std::move(starts_s));
  for (const auto& [number, time_s] : read) {
    // 29.97 frames a second that count 30 drift from it by 0.1 %, in two minutes by 0.12 s.
    if (std::abs(time_s - static_cast<double>(number) / nominal_fps - start_s) > 0.5) continue;
    if (!kept.numbers.empty() && number <= kept.numbers.back()) continue;
    kept.numbers.push_back(number);
    kept.times_s.push_back(time_s);
  }
  return kept;
}

// The whole number, or 1000/1001 of it.
double MeasuredRate(const InOrder& frames, int nominal_fps) {
  const double measured = static_cast<double>(frames.numbers.back() - frames.numbers.front()) /
                          (frames.times_s.back() - frames.times_s.front());
  const double slow = nominal_fps * 1000.0 / 1001;
  return std::abs(measured - slow) < std::abs(measured - nominal_fps) ? slow : nominal_fps;
}

// The sound of one stream, one channel at a time. OutOfRange: no such channel.
absl::StatusOr<std::vector<int16_t>> SamplesOf(const std::string& path, int stream, int channel) {
  WEFT_ASSIGN_OR_RETURN(
      auto ffmpeg,
      VideoProgram::Start(
          "ffmpeg", path,
          {"-hide_banner", "-loglevel", "error", "-nostdin", "-protocol_whitelist", "file,pipe", "-t", "120",
           "-i", absl::StrCat("file:", path), "-map", absl::StrCat("0:a:", stream), "-af",
           absl::StrCat("pan=mono|c0=c", channel), "-ar", absl::StrCat(kRate_hz), "-f", "s16le", "pipe:1"},
          VideoProgram::Out::kKept));
  WEFT_ASSIGN_OR_RETURN(const VideoProgramOutput said, ffmpeg.Finish());
  if (said.wait_status != 0) return absl::OutOfRangeError(LastComplaint(said.errors));
  std::vector<int16_t> samples(said.out.size() / sizeof(int16_t));
  std::memcpy(samples.data(), said.out.data(), samples.size() * sizeof(int16_t));
  return samples;
}

// Of the channels with timecode the one that shows most of it.
absl::StatusOr<LtcReading> ReadLtcOfFile(const std::string& path, const v1::VideoFacts& video) {
  std::optional<LtcReading> best;
  for (int stream = 0; stream < video.audio_channels_size(); ++stream) {
    for (int channel = 0; channel < std::min(video.audio_channels(stream), kMostChannels); ++channel) {
      const auto samples = SamplesOf(path, stream, channel);
      if (!samples.ok() && !absl::IsOutOfRange(samples.status())) return samples.status();
      if (!samples.ok()) continue;
      absl::StatusOr<LtcReading> reading = ReadLtc(*samples, kRate_hz);
      if (!reading.ok() || (best && reading->frames <= best->frames)) continue;
      reading->first_s += video.audio_start_s(stream);
      best = *std::move(reading);
    }
  }
  if (best) return *best;
  return absl::NotFoundError("no timecode in its sound");
}

}  // namespace

absl::StatusOr<LtcReading> ReadLtc(const std::vector<int16_t>& samples, double rate_hz) {
  const std::vector<LtcFrameAt> frames = FramesIn(samples, rate_hz);
  const double period_s = frames.empty() ? 0 : PeriodOfFrames(frames);
  const auto nominal_fps = period_s > 0 ? static_cast<int>(std::lround(1 / period_s)) : 0;
  if (nominal_fps < 20 || nominal_fps > 31) return absl::NotFoundError("no linear timecode");
  const InOrder kept = KeepThoseInOrder(frames, nominal_fps);
  if (kept.numbers.size() < 2 || static_cast<double>(kept.numbers.size()) < kLeast_s * nominal_fps)
    return absl::NotFoundError("too little linear timecode in order");
  LtcReading reading;
  const double fps = MeasuredRate(kept, nominal_fps);
  std::vector<double> starts_s;
  for (size_t i = 0; i < kept.numbers.size(); ++i)
    starts_s.push_back(kept.times_s[i] - static_cast<double>(kept.numbers[i] - kept.numbers.front()) / fps);
  reading.first_s = Median(starts_s);
  for (double& start_s : starts_s) start_s = std::abs(start_s - reading.first_s);
  reading.frames = static_cast<int>(kept.numbers.size());
  reading.sigma_s =
      std::max(kLeastSigma_s, kTelling * Median(std::move(starts_s)) / std::sqrt(reading.frames));
  Timecode like;
  like.nominal_fps = nominal_fps;
  like.fps = fps;
  like.drops = std::ranges::any_of(frames, [](const LtcFrameAt& frame) { return frame.drops; });
  reading.timecode = TimecodeOf(kept.numbers.front(), like);
  return reading;
}

absl::StatusOr<std::vector<v1::CameraSync>> OffsetsByLtc(const std::map<std::string, std::string>& files,
                                                         std::vector<v1::VideoFacts>& videos) {
  std::vector<v1::VideoFacts> told = videos;  // videos stay as they are if one has none
  std::vector<v1::CameraSync> syncs;
  double reference_s = 0;
  for (v1::VideoFacts& video : told) {
    const auto file = files.find(video.camera());
    v1::VideoFacts sound = video;
    double begins_s = 0;  // the sound's beginning by the video's count
    if (file != files.end()) {
      WEFT_ASSIGN_OR_RETURN(sound, ReadSoundHeader(file->second));
      begins_s = BeginTime_s(video);
    }
    const absl::StatusOr<LtcReading> reading = ReadLtcOfFile(sound.path(), sound);
    if (absl::IsNotFound(reading.status()))
      return absl::FailedPreconditionError(
          absl::StrCat(sound.path(), ": has no linear timecode in its sound; name a file that has it (--ltc ",
                       video.camera(), "=FILE.wav), or a rig and a board (--sync motion)"));
    if (!reading.ok()) return reading.status();
    const double first_s = FrameTimes_s(video).front(), at_s = begins_s + reading->first_s;
    double offset_s = reading->timecode.Seconds() - at_s;
    if (syncs.empty()) reference_s = offset_s + first_s;
    const double day_s = reading->timecode.Day_s();
    offset_s -= day_s * std::round((offset_s + first_s - reference_s) / day_s);
    const auto since = std::llround((first_s - at_s) * reading->timecode.fps);
    video.set_timecode(TimecodeText(TimecodeOf(reading->timecode.Number() + since, reading->timecode)));
    video.set_timecode_fps(reading->timecode.fps);
    video.set_is_timecode_fps_sure(true);
    video.set_timecode_at_s(first_s);
    v1::CameraSync& sync = syncs.emplace_back();
    sync.set_offset_s(offset_s);
    sync.set_offset_sigma_s(reading->sigma_s);
    sync.set_found_by(NameOf(SyncWay::kLtc));
  }
  videos = std::move(told);
  return syncs;
}

}  // namespace weft
