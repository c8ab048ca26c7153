// What videos and ffmpeg say in text: timecode, headers, times of frames.
#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include "services/studio/video/damage.h"
#include "services/studio/video/ltc.h"
#include "services/studio/video/presentation.h"
#include "services/studio/video/timecode.h"
#include "services/studio/video/timecode_track.h"
#include "services/studio/video/video_facts.h"
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

// Every frame is used or is not, and used ones rise.
void TryLines(std::string_view text) {
  const auto lines = weft::ParseFrameLines(text);
  if (!lines.ok()) return;
  weft::v1::VideoFacts facts;
  if (!weft::UseFrames(lines->pts, {3, 4}, facts).ok()) return;
  FuzzRequire(static_cast<size_t>(facts.frame_pts_size() + facts.unused_size()) == lines->pts.size());
  for (int i = 1; i < facts.frame_pts_size(); ++i) FuzzRequire(facts.frame_pts(i) > facts.frame_pts(i - 1));
}

void TryTrack(std::string_view text) {
  weft::v1::VideoFacts facts;
  if (!weft::ParseTimecodeTrack(text, facts).ok()) return;
  const double fps = weft::TimecodeRates({facts}).front();
  FuzzRequire(fps >= 0 && (fps == 0 || weft::LabelOf(facts, fps).ok()));
}

// Times by order are those of the packets.
void TryPresentation(std::string_view text) {
  const auto packets = weft::ParsePackets(text);
  if (!packets.ok()) return;
  std::vector<int64_t> late;
  for (const weft::VideoPacket& packet : *packets) late.push_back(packet.dts + 2);
  const auto times = weft::TimesByOrder(*packets, {late, 2, false});
  if (times.ok()) weft::FuzzRequire(times->empty() || times->size() == packets->size());
  for (int stream = 0; stream < 2; ++stream) {
    const std::vector<weft::VideoEdit> edits = weft::ParseEdits(text, stream);
    [[maybe_unused]] const bool fits = weft::CheckEdits(edits, *packets, 0.001).ok();
  }
}

// Damaged pictures are pictures of the film.
void TryDamage(std::string_view text) {
  weft::DecodedPictures pictures;
  auto packets = weft::ParsePackets(text);
  if (packets.ok()) pictures.packets = *std::move(packets);
  for (size_t i = 0; i < pictures.packets.size(); i += 2)
    pictures.shown_pts.push_back(pictures.packets[i].pts);
  const weft::DecoderLog log = weft::ParseDecoderLog(text, "h264", "mov,mp4");
  const std::vector<int64_t> damaged = weft::DamagedPictures(pictures, log);
  FuzzRequire(damaged.size() <= pictures.packets.size());
  FuzzRequire(std::is_sorted(damaged.begin(), damaged.end()));
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
  TryTrack(text);
  TryPresentation(text);
  TryDamage(text);
  TrySound(data, size);
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() {
  return {
      "10:22:33:12",
      "23:59:59;29",
      "frame:0    pts:0       pts_time:0\nweft=1\nframe:1    pts:1001    pts_time:0.033367\nweft=1\n",
      "packets.packet.0.pts=-30030\npackets.packet.0.data=\"\\n00000000: 0011 195a      ...Z\\n\"\n"
      "streams.stream.0.time_base=\"1/30000\"\nstreams.stream.0.extradata=\"\\n00000000: 0000 0000 0000 0001 "
      "0000 7530 0000 03e9  ..........u0....\\n00000010: 1e00 0000          ....\\n\"\n",
      "0,-2,K_\n3,-1,__\n1,0,__\n2,1,_D\n4,2,K_\n"
      "[info] demuxer+ffmpeg -> ist_index:0 type:video pkt_pts:3 pkt_pts_time:1 pkt_dts:1 \n"
      "[h264 @ 0x55d1] [error] error while decoding MB 0 4, bytestream 734\n"
      "[warning] a.mp4: corrupt decoded frame in stream 0\n"
      "[info] decoder -> ist_index:0 type:video frame_pts:4 frame_pts_time:1 best_effort_ts:4 \n",
      "N/A,0,K_\nN/A,1,__\n2,2,__\nN/A,3,__\n[mov @ 0x1] Processing st: 0, edit list 0 - media time: 2, "
      "duration: 3\n"
      "[mov @ 0x1] Processing st: 0, edit list 1 - media time: -1, duration: 9\n"
      "[mov @ 0x1] Processing st: 1, edit list 0 - media time: 5, duration: 7\n",
      "streams.stream.0.codec_type=\"video\"\nstreams.stream.0.width=320\nstreams.stream.0.height=240\n"
      "streams.stream.0.pix_fmt=\"yuv420p\"\nstreams.stream.0.r_frame_rate=\"30000/1001\"\n"
      "streams.stream.0.avg_frame_rate=\"30000/1001\"\nstreams.stream.0.time_base=\"1/30000\"\n"
      "streams.stream.0.nb_frames=\"60\"\nstreams.stream.0.tags.timecode=\"10:22:33;12\"\n"
      "streams.stream.1.codec_type=\"audio\"\n"
      "format.tags.creation_time=\"2026-01-02T03:04:05.000000Z\"\n"};
}
