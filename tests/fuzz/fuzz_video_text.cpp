// What videos and ffmpeg say in text: timecode, headers, times of frames.
#include <cstring>
#include <string>
#include <vector>

#include "services/video/ltc.h"
#include "services/video/timecode.h"
#include "services/video/video_facts.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

using weft::FuzzRequire;

// What is accepted can be printed and is accepted again, and its number gives it back.
void TryTimecode(std::string_view text, double fps) {
  const auto timecode = weft::ParseTimecode(text, fps);
  if (!timecode.ok()) return;
  FuzzRequire(timecode->Number() >= 0);
  const std::string printed = weft::TimecodeText(*timecode);
  const auto again = weft::ParseTimecode(printed, fps);
  FuzzRequire(again.ok() && again->Number() == timecode->Number());
  FuzzRequire(weft::TimecodeText(weft::TimecodeOf(timecode->Number(), *timecode)) == printed);
}

void TryHeader(std::string_view text) {
  const auto facts = weft::ParseVideoHeader(text);
  if (!facts.ok()) return;
  FuzzRequire(facts->width_px() > 0 && facts->height_px() > 0);
  FuzzRequire(facts->time_base_num() > 0 && facts->time_base_den() > 0);
  weft::v1::VideoFacts with_frames = *facts;
  with_frames.add_frame_pts(0);
  with_frames.add_frame_pts(1);
  [[maybe_unused]] const bool has_timecode = weft::TimecodeOfFirst(with_frames).ok();
}

void TryLines(std::string_view text) {
  const auto pts = weft::ParseFrameLines(text);
  for (size_t i = 1; pts.ok() && i < pts->size(); ++i) FuzzRequire((*pts)[i] > (*pts)[i - 1]);
}

void TrySound(const uint8_t* data, size_t size) {
  std::vector<int16_t> samples(size / sizeof(int16_t));
  std::memcpy(samples.data(), data, samples.size() * sizeof(int16_t));
  const auto reading = weft::ReadLtc(samples, 48000);
  if (reading.ok()) FuzzRequire(reading->timecode.Number() >= 0 && reading->frames > 0);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  for (const double fps : {23.976, 25.0, 29.97, 59.94, 120.0, 12.5}) TryTimecode(text, fps);
  TryHeader(text);
  TryLines(text);
  TrySound(data, size);
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() {
  return {"10:22:33:12", "23:59:59;29",
          "frame:0    pts:0       pts_time:0\nweft=1\nframe:1    pts:1001    pts_time:0.033367\nweft=1\n",
          "streams.stream.0.codec_type=\"video\"\nstreams.stream.0.width=320\nstreams.stream.0.height=240\n"
          "streams.stream.0.pix_fmt=\"yuv420p\"\nstreams.stream.0.r_frame_rate=\"30000/1001\"\n"
          "streams.stream.0.avg_frame_rate=\"30000/1001\"\nstreams.stream.0.time_base=\"1/30000\"\n"
          "streams.stream.0.nb_frames=\"60\"\nstreams.stream.0.tags.timecode=\"10:22:33;12\"\n"
          "streams.stream.1.codec_type=\"audio\"\n"
          "format.tags.creation_time=\"2026-01-02T03:04:05.000000Z\"\n"};
}
