#include "services/studio/video/video_facts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <sstream>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "services/studio/video/frame_times.h"
#include "services/studio/video/timecode_track.h"
#include "services/studio/video/video_packets.h"
#include "tests/services/studio/video/made_video.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::string WhyRefused(const std::string& path) {
  const auto facts = InspectVideo(path);
  return facts.ok() ? "" : std::string(facts.status().message());
}

TEST(InspectVideo, KnowsSizeTimesAndTimecode) {
  const TempFolder temp;
  MakeVideo(temp / "a.mov", Values(10, 60), "30000/1001", "-c:v libx264 -bf 2 -timecode '10:22:33;12'");
  const auto facts = InspectVideo(temp / "a.mov");
  ASSERT_TRUE(facts.ok()) << facts.status();
  EXPECT_EQ(facts->width_px(), 32);
  EXPECT_EQ(facts->height_px(), 16);
  EXPECT_EQ(facts->frame_pts_size(), 60);
  EXPECT_EQ(facts->frames_declared(), 60u);
  EXPECT_EQ(facts->complaint(), "");
  EXPECT_NEAR(Period_s(*facts), 1001.0 / 30000, 1e-9);
  EXPECT_NEAR(FrameTimes_s(*facts).back() - FrameTimes_s(*facts).front(), 59 * 1001.0 / 30000, 1e-9);
  const auto timecode = TimecodeOfFirst(*facts);
  ASSERT_TRUE(timecode.ok()) << timecode.status();
  EXPECT_EQ(TimecodeText(*timecode), "10:22:33;12");
  EXPECT_NEAR(timecode->fps, 29.97, 0.001);
}

TEST(InspectVideo, ReadsTheTimecodeOfMatroska) {
  const TempFolder temp;
  MakeVideo(temp / "b.mkv", Values(10, 5), "24", "-c:v ffv1 -timecode 01:00:00:23");
  const auto facts = InspectVideo(temp / "b.mkv");
  ASSERT_TRUE(facts.ok()) << facts.status();
  EXPECT_EQ(TimecodeOfFirst(*facts)->Number(), 3600 * 24 + 23);
  MakeVideo(temp / "none.mkv", Values(10, 5), "24");
  EXPECT_TRUE(absl::IsNotFound(TimecodeOfFirst(*InspectVideo(temp / "none.mkv")).status()));
}

TEST(InspectVideo, KeepsWhatATruncatedFileHolds) {
  const TempFolder temp;
  MakeVideo(temp / "whole.mkv", Values(0, 100), "25", "-c:v ffv1 -g 1 -vf noise=alls=90");
  const std::string bytes = ReadBytes(temp / "whole.mkv");
  WriteBytes(temp / "cut.mkv", bytes.substr(0, bytes.size() / 2));
  const auto facts = InspectVideo(temp / "cut.mkv");
  ASSERT_TRUE(facts.ok()) << facts.status();
  EXPECT_GT(facts->frame_pts_size(), 30);
  EXPECT_LT(facts->frame_pts_size(), 70);
  EXPECT_NE(facts->complaint(), "");
}

TEST(InspectVideo, SaysWhyAFileIsNoVideo) {
  const TempFolder temp;
  EXPECT_TRUE(absl::IsNotFound(InspectVideo(temp / "nothing.mp4").status()));
  WriteBytes(temp / "empty.mp4", "");
  EXPECT_THAT(WhyRefused(temp / "empty.mp4"),
              AllOf(HasSubstr("empty.mp4: the file is empty"), HasSubstr("copy")));
  WriteBytes(temp / "noise.mp4", std::string(5000, 'x'));
  EXPECT_THAT(WhyRefused(temp / "noise.mp4"), HasSubstr("noise.mp4: ffmpeg cannot read it"));
  MakeVideo(temp / "whole.mp4", Values(0, 50), "25", "-c:v libx264 -vf noise=alls=90");
  const std::string bytes = ReadBytes(temp / "whole.mp4");
  WriteBytes(temp / "cut.mp4", bytes.substr(0, bytes.size() / 2));
  EXPECT_THAT(WhyRefused(temp / "cut.mp4"), HasSubstr("the file was cut off, or its recording never ended"));
  Shell("ffmpeg -v error -f lavfi -i sine=duration=1 '" + (temp / "sound.mov") + "'");
  EXPECT_THAT(WhyRefused(temp / "sound.mov"), HasSubstr("sound.mov: it holds no video"));
}

TEST(InspectVideo, ReadsThatFileAndNoOther) {
  const TempFolder temp;
  MakeVideo(temp / "secret.mkv", Values(10, 5), "24");
  WriteBytes(temp / "list.mkv", "ffconcat version 1.0\nfile secret.mkv\n");
  EXPECT_THAT(WhyRefused(temp / "list.mkv"), HasSubstr("ffmpeg cannot read it"));
}

// All that ffprobe and the decoder say of a small film.
TEST(InspectVideo, TellsAllThatImportsNeed) {
  const TempFolder temp;
  const std::string path = temp / "a.mov";
  MakeVideo(path, Values(10, 5), "30", "-c:v libx264 -bf 0 -timecode 10:22:33:12");
  auto facts = InspectVideo(path);
  ASSERT_TRUE(facts.ok()) << facts.status();
  EXPECT_EQ(facts->bytes(), std::filesystem::file_size(path));
  const auto modified = std::chrono::file_clock::to_sys(std::filesystem::last_write_time(path));
  EXPECT_EQ(facts->modified_unix_ns(),
            std::chrono::duration_cast<std::chrono::nanoseconds>(modified.time_since_epoch()).count());
  EXPECT_EQ(facts->path(), path);
  facts->clear_path(), facts->clear_bytes(), facts->clear_modified_unix_ns();
  EXPECT_EQ(facts->DebugString(), FactsText(R"(
      width_px: 32 height_px: 16 pixels: "yuv420p" time_base_num: 1 time_base_den: 15360
      frame_pts: [0, 512, 1024, 1536, 2048] frames_declared: 5 declared_fps: 30
      timecode: "10:22:33:12" timecode_fps: 30 is_timecode_fps_sure: true
      codec: "h264" container: "mov,mp4,m4a,3gp,3g2,mj2")"));
}

// Copied from its 11th picture on: decoding begins with the key frame before.
TEST(InspectVideo, PicturesThatAnEditListHidesAreCountedAndNotShown) {
  const TempFolder temp;
  MakeVideo(temp / "whole.mp4", Values(10, 40), "25",
            "-c:v libx264 -bf 0 -g 8 -keyint_min 8 -sc_threshold 0");
  Shell("ffmpeg -v error -y -ss 0.4 -i '" + (temp / "whole.mp4") + "' -c copy '" + (temp / "part.mp4") + "'");
  const auto facts = InspectVideo(temp / "part.mp4");
  ASSERT_TRUE(facts.ok()) << facts.status();
  EXPECT_EQ(facts->hidden(), 2u);
  EXPECT_EQ(facts->frame_pts_size(), 30);
  EXPECT_EQ(facts->frames_declared(), 32u);
  EXPECT_EQ(facts->begin_pts(), 0);
  EXPECT_EQ(facts->complaint(), "");
  EXPECT_THAT(facts->damaged_pts(), ::testing::IsEmpty());
}

// Its packets outnumber its pictures: some are there for others to follow from, at times of their own.
TEST(InspectVideo, PacketsThatACodeNeverShowsAreNotMissing) {
  const TempFolder temp;
  const std::string encode =
      "cd '" + temp.path() +
      "' && ffmpeg -v error -y -f lavfi -i testsrc2=s=64x48:r=25:d=2 -c:v libvpx -enc_time_base 1/1000 "
      "-b:v 200k -auto-alt-ref 1 -lag-in-frames 16 -pass ";
  Shell(encode + "1 -f null -");
  Shell(encode + "2 a.webm");
  const auto packets = ReadPackets(temp / "a.webm", nullptr);
  ASSERT_TRUE(packets.ok()) << packets.status();
  ASSERT_GT(packets->size(), 50u);
  const auto facts = InspectVideo(temp / "a.webm");
  ASSERT_TRUE(facts.ok()) << facts.status();
  EXPECT_EQ(facts->codec(), "vp8");
  EXPECT_EQ(facts->frame_pts_size(), 50);
  EXPECT_THAT(facts->damaged_pts(), ::testing::IsEmpty());
  EXPECT_THAT(facts->unused(), ::testing::IsEmpty());
  EXPECT_EQ(facts->complaint(), "");
}

TEST(InspectVideo, CountsPicturesOfTwoFields) {
  const TempFolder temp;
  MakeVideo(temp / "a.mp4", Values(10, 6), "25", "-c:v libx264 -flags +ildct+ilme -x264opts tff=1");
  const auto facts = InspectVideo(temp / "a.mp4");
  ASSERT_TRUE(facts.ok()) << facts.status();
  EXPECT_EQ(facts->interlaced(), 6u);
  EXPECT_EQ(facts->frame_pts_size(), 6);
}

// Bytes within the 16th packet of 40, whose key frames are ten apart.
TEST(InspectVideo, LeavesOutADamagedPictureAndThoseThatFollowFromIt) {
  const TempFolder temp;
  const std::string path = temp / "a.mp4";
  Shell(
      "ffmpeg -v error -y -f lavfi -i testsrc2=s=96x64:r=25:d=1.6 -c:v libx264 -threads 1 -g 10 -keyint_min "
      "10 "
      "-sc_threshold 0 -bf 0 '" +
      path + "'");
  Shell("ffprobe -v error -select_streams v:0 -show_entries packet=pos,size -of default=nk=1:nw=1 '" + path +
        "' > '" + path + ".packets'");
  std::istringstream packets(ReadBytes(path + ".packets"));
  size_t size = 0, at = 0;
  for (int i = 0; i <= 15; ++i) packets >> size >> at;
  std::string bytes = ReadBytes(path);
  ASSERT_LT(at + size, bytes.size());
  for (size_t i = 0; i < 40; ++i) bytes[at + size / 2 + i] ^= 0x5a;
  WriteBytes(path, bytes);
  const auto facts = InspectVideo(path);
  ASSERT_TRUE(facts.ok()) << facts.status();
  EXPECT_THAT(facts->damaged_pts(), ::testing::ElementsAre(7680, 8192, 8704, 9216, 9728));
  EXPECT_THAT(facts->unused(), ::testing::ElementsAre(15, 16, 17, 18, 19));
  EXPECT_EQ(facts->frame_pts_size(), 35);
  EXPECT_EQ(facts->frame_pts(14), 14 * 512);
  EXPECT_EQ(facts->frame_pts(15), 20 * 512);
  EXPECT_THAT(facts->complaint(), HasSubstr("error while decoding MB"));
  EXPECT_EQ(facts->same_time(), 0u);
}

TEST(InspectVideo, IsStoppedByWhoWatchesIt) {
  const TempFolder temp;
  Shell("ffmpeg -v error -y -f lavfi -i testsrc2=s=640x480:r=25:d=8 -c:v mjpeg '" + (temp / "a.mkv") + "'");
  const auto stopped = InspectVideo(temp / "a.mkv", [](uint64_t) { return false; });
  EXPECT_TRUE(absl::IsCancelled(stopped.status())) << stopped.status();
  EXPECT_EQ(InspectVideo(temp.path()).status().message(), temp.path() + ": not a file");
  EXPECT_EQ(InspectVideo(temp / "b.mkv").status().message(), temp / "b.mkv" + std::string(": no such file"));
}

TEST(ReadSoundHeader, TellsOfSoundAlone) {
  const TempFolder temp;
  Shell("ffmpeg -v error -f lavfi -i sine=duration=0.2 -f lavfi -i anullsrc=cl=stereo:d=0.2 -map 0 -map 1 '" +
        (temp / "sound.mka") + "'");
  const auto sound = ReadSoundHeader(temp / "sound.mka");
  ASSERT_TRUE(sound.ok()) << sound.status();
  EXPECT_EQ(sound->path(), std::filesystem::canonical(temp / "sound.mka").string());
  EXPECT_THAT(sound->audio_channels(), ::testing::ElementsAre(1, 2));
  EXPECT_EQ(sound->audio_start_s_size(), 2);
  EXPECT_TRUE(absl::IsNotFound(ReadSoundHeader(temp / "none.wav").status()));
  EXPECT_THAT(std::string(ReadSoundHeader(temp / "none.wav").status().message()), HasSubstr("no such file"));
  MakeVideo(temp / "silent.mkv", Values(10, 2), "24");
  EXPECT_THAT(std::string(ReadSoundHeader(temp / "silent.mkv").status().message()),
              HasSubstr("silent.mkv: it holds no sound"));
}

TEST(DecodingArguments, SoundFilmsAreDecodedByTwoThreads) {
  v1::VideoFacts facts;
  const auto said = [&] { return absl::StrJoin(DecodingArguments(facts), " "); };
  const std::string one =
      "-hide_banner -loglevel repeat+level+warning -nostdin -y -copyts -threads 1 -noautorotate "
      "-err_detect crccheck -protocol_whitelist file,pipe";
  const std::string two = absl::StrReplaceAll(one, {{"-threads 1", "-threads 2"}});
  EXPECT_EQ(said(), one);
  facts.add_frame_pts(0);
  EXPECT_EQ(said(), two);
  facts.add_unused(1);
  EXPECT_EQ(said(), one);
  facts.clear_unused();
  facts.set_complaint("no");
  EXPECT_EQ(said(), one);
  facts.clear_complaint();
  facts.add_decoded_pts(1);
  EXPECT_EQ(said(), one);
  facts.clear_decoded_pts();
  facts.set_codec("h264");
  EXPECT_EQ(said(), absl::StrReplaceAll(two, {{"crccheck", "crccheck+aggressive"}}));
  EXPECT_EQ(FrameLinesFilter("pipe:1"),
            R"(metadata=mode=add:key=weft:value=1,metadata=mode=print:file=pipe\\:1)");
}

// Whatever ffprobe says of a film; the first stream of pictures counts.
constexpr const char* kHeader = R"(streams.stream.0.codec_type="audio"
streams.stream.0.channels=2
streams.stream.0.start_time="0.500000"
streams.stream.1.codec_type="video"
streams.stream.1.codec_name="hevc"
streams.stream.1.width=65536
streams.stream.1.height=65536
streams.stream.1.has_b_frames=3
streams.stream.1.pix_fmt="yuv420p10le"
streams.stream.1.field_order="tb"
streams.stream.1.r_frame_rate="60/1"
streams.stream.1.avg_frame_rate="59/2"
streams.stream.1.time_base="2/30000"
streams.stream.1.nb_frames="77"
streams.stream.1.tags.creation_time="2026-01-02T03:04:05.250000Z"
streams.stream.2.codec_type="audio"
streams.stream.2.channels=-1
streams.stream.2.start_time="inf"
streams.stream.3.codec_type="video"
streams.stream.3.width=8
streams.stream.4.tags.timecode="01:02:03:04"
streams.stream.63.codec_type="audio"
streams.stream.63.channels=6
streams.stream.64.codec_type="audio"
format.format_name="mxf"
format.tags.creation_time="2020-01-02T03:04:05Z"
)";

std::string WithLine(const std::string& name, const std::string& value) {
  std::string header = kHeader;
  const size_t at = header.find(name + "=");
  EXPECT_NE(at, std::string::npos) << name;
  return header.substr(0, at) + (value.empty() ? "" : name + "=" + value) +
         header.substr(header.find('\n', at));
}

TEST(ParseVideoHeader, TakesFromTheHeaderWhatItSays) {
  const auto facts = ParseVideoHeader(kHeader);
  ASSERT_TRUE(facts.ok()) << facts.status();
  EXPECT_EQ(facts->DebugString(), FactsText(R"(
      width_px: 65536 height_px: 65536 pixels: "yuv420p10le" time_base_num: 2 time_base_den: 30000
      frames_declared: 77 declared_fps: 29.5 timecode: "01:02:03:04" created_unix_ns: 1767323045250000000
      audio_channels: [2, 0, 6] audio_start_s: [0.5, 0, 0] codec: "hevc" container: "mxf" stream: 1 waits: 3
      interlaced: 1)"));
}

TEST(ParseVideoHeader, DoesWithoutWhatIsNotThere) {
  const auto with = [](const std::string& name, const std::string& value) {
    const auto facts = ParseVideoHeader(WithLine(name, value));
    EXPECT_TRUE(facts.ok()) << facts.status();
    return facts.value_or(v1::VideoFacts());
  };
  EXPECT_EQ(with("streams.stream.1.avg_frame_rate", "\"0/0\"").declared_fps(), 60);
  EXPECT_EQ(with("streams.stream.1.nb_frames", "\"-1\"").frames_declared(), 0u);
  EXPECT_EQ(with("streams.stream.1.has_b_frames", "-1").waits(), 0);
  EXPECT_EQ(with("streams.stream.1.tags.creation_time", "").created_unix_ns(), 1577934245000000000);
  for (const char* order : {"tt", "bb", "tb", "bt"})
    EXPECT_EQ(with("streams.stream.1.field_order", absl::StrCat("\"", order, "\"")).interlaced(), 1u);
  EXPECT_EQ(with("streams.stream.1.field_order", "\"progressive\"").interlaced(), 0u);
  EXPECT_EQ(with("streams.stream.4.tags.timecode", "\"a\x1b[2J\"").timecode(), "");
  const auto why = [](const std::string& name, const std::string& value) {
    return std::string(ParseVideoHeader(WithLine(name, value)).status().message());
  };
  for (const char* side : {"streams.stream.1.width", "streams.stream.1.height"})
    for (const char* px : {"0", "65537"})
      EXPECT_EQ(why(side, px), "its pictures have no size; is it damaged?") << side << px;
  EXPECT_EQ(why("streams.stream.1.pix_fmt", "\"a\x1b\""), "its header makes no sense; is it damaged?");
  EXPECT_EQ(why("streams.stream.1.time_base", ""), "its header makes no sense; is it damaged?");
}

TEST(ParseSoundHeader, KnowsEveryStreamOfSound) {
  const auto facts = ParseSoundHeader(kHeader);
  ASSERT_TRUE(facts.ok()) << facts.status();
  EXPECT_EQ(facts->DebugString(), FactsText("audio_channels: [2, 0, 6] audio_start_s: [0.5, 0, 0]"));
  EXPECT_EQ(ParseSoundHeader("streams.stream.0.codec_type=\"video\"\n").status().message(),
            "it holds no sound");
}

TEST(ParseVideoHeader, RefusesWhatMakesNoSense) {
  const auto why = [](std::string_view flat) {
    return std::string(ParseVideoHeader(flat).status().message());
  };
  EXPECT_THAT(why(""), HasSubstr("no video"));
  EXPECT_THAT(why("streams.stream.0.codec_type=\"video\"\nstreams.stream.0.width=0\n"), HasSubstr("no size"));
  EXPECT_THAT(why("streams.stream.0.codec_type=\"video\"\nstreams.stream.0.width=8\n"
                  "streams.stream.0.height=8\nstreams.stream.0.time_base=\"0/0\"\n"),
              HasSubstr("no sense"));
}

TEST(ParseFrameLines, ReadsTimesAndFields) {
  const auto lines = ParseFrameLines(
      "frame:0    pts:5       pts_time:0.2\nweft=1\nframe:0    pts:5       pts_time:0.2\nweft=2\n"
      "frame:1    pts:9  pts_time:1\nweft=1\n");
  ASSERT_TRUE(lines.ok()) << lines.status();
  EXPECT_THAT(lines->pts, ::testing::ElementsAre(5, 9));
  EXPECT_EQ(lines->interlaced, 1u);
  const auto why = [](std::string_view text) {
    return std::string(ParseFrameLines(text).status().message());
  };
  EXPECT_THAT(why("frame:0 pts:NOPTS pts_time:NOPTS\nweft=1\n"), HasSubstr("carry no times"));
  EXPECT_THAT(why("frame:0 pts:5\nweft=1\nframe:0 pts:6\nweft=1\n"),
              HasSubstr("change their size or format at frame 1"));
  EXPECT_THAT(why("frame:0\nweft=1\n"), HasSubstr("carry no times"));
  EXPECT_THAT(why("frame:0 dts:5\nweft=1\n"), HasSubstr("carry no times"));
  // A quarter of all numbers: their differences are numbers, too.
  EXPECT_EQ(why("frame:0 pts:2305843009213693951\nweft=1\n"), "");
  EXPECT_EQ(why("frame:0 pts:-2305843009213693951\nweft=1\n"), "");
  EXPECT_THAT(why("frame:0 pts:2305843009213693952\nweft=1\n"), HasSubstr("impossible times"));
  EXPECT_THAT(why("frame:0 pts:-2305843009213693952\nweft=1\n"), HasSubstr("impossible times"));
  const auto rest = ParseFrameLines("weft=1\nlavfi.x=2\nframe:0 pts:5\nlavfi.x=2\nweft=1\nframe:1 pts:7\n");
  ASSERT_TRUE(rest.ok()) << rest.status();
  EXPECT_THAT(rest->pts, ::testing::ElementsAre(5));
  EXPECT_EQ(rest->interlaced, 0u);
}

TEST(UseFrames, TakesWholeOnesThatAreLater) {
  v1::VideoFacts facts;
  ASSERT_TRUE(UseFrames({1, 2, 2, 3, 5, 4, 6}, {3, 4}, facts).ok());
  EXPECT_THAT(facts.frame_pts(), ::testing::ElementsAre(1, 2, 5, 6));
  EXPECT_THAT(facts.unused(), ::testing::ElementsAre(2, 3, 5));
  EXPECT_EQ(facts.same_time(), 1u);
  v1::VideoFacts back;
  const absl::Status status = UseFrames({1, 3, 2}, {}, back);
  EXPECT_TRUE(absl::IsInvalidArgument(status));
  EXPECT_EQ(status.message(),
            "the time of frame 2 is not after that of the frame before; write it anew: "
            "ffmpeg -i FILE -c:v ffv1 FILE.mkv");
  EXPECT_EQ(back.same_time(), 0u);
}

}  // namespace
}  // namespace weft
