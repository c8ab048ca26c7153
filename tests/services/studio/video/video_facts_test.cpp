#include "services/studio/video/video_facts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "services/studio/video/frame_times.h"
#include "services/studio/video/timecode_track.h"
#include "tests/services/studio/video/made_video.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::string WhyRefused(const std::string& path) {
  const auto facts = LookAtVideo(path);
  return facts.ok() ? "" : std::string(facts.status().message());
}

TEST(LookAtVideo, KnowsSizeTimesAndTimecode) {
  const TempFolder temp;
  MakeVideo(temp / "a.mov", Values(10, 60), "30000/1001", "-c:v libx264 -bf 2 -timecode '10:22:33;12'");
  const auto facts = LookAtVideo(temp / "a.mov");
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

TEST(LookAtVideo, ReadsTheTimecodeOfMatroska) {
  const TempFolder temp;
  MakeVideo(temp / "b.mkv", Values(10, 5), "24", "-c:v ffv1 -timecode 01:00:00:23");
  const auto facts = LookAtVideo(temp / "b.mkv");
  ASSERT_TRUE(facts.ok()) << facts.status();
  EXPECT_EQ(TimecodeOfFirst(*facts)->Number(), 3600 * 24 + 23);
  MakeVideo(temp / "none.mkv", Values(10, 5), "24");
  EXPECT_TRUE(absl::IsNotFound(TimecodeOfFirst(*LookAtVideo(temp / "none.mkv")).status()));
}

TEST(LookAtVideo, KeepsWhatATruncatedFileHolds) {
  const TempFolder temp;
  MakeVideo(temp / "whole.mkv", Values(0, 100), "25", "-c:v ffv1 -g 1 -vf noise=alls=90");
  const std::string bytes = ReadBytes(temp / "whole.mkv");
  WriteBytes(temp / "cut.mkv", bytes.substr(0, bytes.size() / 2));
  const auto facts = LookAtVideo(temp / "cut.mkv");
  ASSERT_TRUE(facts.ok()) << facts.status();
  EXPECT_GT(facts->frame_pts_size(), 30);
  EXPECT_LT(facts->frame_pts_size(), 70);
  EXPECT_NE(facts->complaint(), "");
}

TEST(LookAtVideo, SaysWhyAFileIsNoVideo) {
  const TempFolder temp;
  EXPECT_TRUE(absl::IsNotFound(LookAtVideo(temp / "nothing.mp4").status()));
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

TEST(LookAtVideo, ReadsThatFileAndNoOther) {
  const TempFolder temp;
  MakeVideo(temp / "secret.mkv", Values(10, 5), "24");
  WriteBytes(temp / "list.mkv", "ffconcat version 1.0\nfile secret.mkv\n");
  EXPECT_THAT(WhyRefused(temp / "list.mkv"), HasSubstr("ffmpeg cannot read it"));
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
}

TEST(UseFrames, TakesWholeOnesThatAreLater) {
  v1::VideoFacts facts;
  ASSERT_TRUE(UseFrames({1, 2, 2, 3, 5, 4, 6}, {3, 4}, facts).ok());
  EXPECT_THAT(facts.frame_pts(), ::testing::ElementsAre(1, 2, 5, 6));
  EXPECT_THAT(facts.unused(), ::testing::ElementsAre(2, 3, 5));
  EXPECT_EQ(facts.same_time(), 1u);
  v1::VideoFacts back;
  EXPECT_THAT(std::string(UseFrames({1, 3, 2}, {}, back).message()),
              HasSubstr("the time of frame 2 is not after"));
}

}  // namespace
}  // namespace weft
