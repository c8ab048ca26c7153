#include "services/studio/video/camera_offsets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

namespace weft {
namespace {

using ::testing::HasSubstr;

v1::VideoFacts VideoAt(const std::string& camera, const std::vector<int64_t>& pts_ms) {
  v1::VideoFacts facts;
  facts.set_camera(camera);
  facts.set_time_base_num(1);
  facts.set_time_base_den(1000);
  for (const int64_t pts : pts_ms) facts.add_frame_pts(pts);
  return facts;
}

TEST(SyncWays, AreNamed) {
  for (const char* name : {"auto", "timecode", "ltc", "motion", "file-times", "together"}) {
    const auto way = SyncWayFromName(name);
    ASSERT_TRUE(way.ok()) << name;
    EXPECT_EQ(NameOf(*way), name);
  }
  EXPECT_EQ(SyncWayFromName("sound").status().message(),
            "sync \"sound\": must be one of auto, timecode, ltc, motion, file-times, together");
}

TEST(CameraOffsets, ThatAreGivenReplaceWhatWasFound) {
  const std::vector<v1::VideoFacts> videos = {VideoAt("a", {0}), VideoAt("b", {0})};
  std::vector<v1::CameraSync> syncs(2);
  syncs[1].set_offset_s(7);
  syncs[1].set_offset_sigma_s(0.5);
  ASSERT_TRUE(UseGivenOffsets({{"b", -0.25}}, videos, syncs).ok());
  EXPECT_EQ(syncs[0].found_by(), "");
  EXPECT_EQ(syncs[1].found_by(), "given");
  EXPECT_EQ(syncs[1].offset_s(), -0.25);
  EXPECT_EQ(syncs[1].offset_sigma_s(), 0);
  const absl::Status unknown = UseGivenOffsets({{"c", 1}}, videos, syncs);
  EXPECT_EQ(unknown.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(unknown.message()), HasSubstr("--offset c"));
  EXPECT_FALSE(UseGivenOffsets({{"a", NAN}}, videos, syncs).ok());
}

TEST(CameraOffsets, BeginWithTheFirstFrameOfAll) {
  const std::vector<v1::VideoFacts> videos = {VideoAt("a", {500, 540}), VideoAt("b", {0, 40})};
  std::vector<v1::CameraSync> syncs(2);
  syncs[0].set_offset_s(1);
  syncs[1].set_offset_s(1.25);
  BeginAtZero(videos, syncs);
  // b's frame at 0 + 1.25 s is the first.
  const std::vector<std::vector<double>> times_s = CommonFrameTimes_s(videos, syncs);
  EXPECT_NEAR(times_s[0][0], 0.25, 1e-12);
  EXPECT_NEAR(times_s[1][0], 0, 1e-12);
  EXPECT_NEAR(times_s[1][1], 0.04, 1e-12);
}

TEST(CameraOffsets, OfTimecodeAreSecondsOfTheDay) {
  std::vector<v1::VideoFacts> videos = {VideoAt("a", {0, 40, 80}), VideoAt("b", {0, 40, 80})};
  videos[0].set_timecode("01:00:00:05");
  videos[1].set_timecode("01:00:01:00");
  videos[1].set_timecode_at_s(0.5);
  const auto syncs = OffsetsByTimecode(videos);
  ASSERT_TRUE(syncs.ok()) << syncs.status();
  ASSERT_EQ(syncs->size(), 2u);
  EXPECT_NEAR((*syncs)[0].offset_s(), 3600.2, 1e-9);
  EXPECT_NEAR((*syncs)[1].offset_s(), 3600.5, 1e-9);
  EXPECT_NEAR((*syncs)[1].offset_sigma_s(), 0.04 / std::sqrt(12), 1e-9);
  EXPECT_EQ((*syncs)[1].found_by(), "timecode");
  videos[1].set_path("b.mov");
  videos[1].clear_timecode();
  const absl::Status without = OffsetsByTimecode(videos).status();
  EXPECT_TRUE(absl::IsFailedPrecondition(without));
  EXPECT_EQ(without.message(),
            "b.mov: has no timecode; name a rig and a board (--sync motion), or give its offset (--offset "
            "b=SECONDS)");
  videos[1].set_timecode("noon");
  EXPECT_TRUE(absl::IsInvalidArgument(OffsetsByTimecode(videos).status()));
}

TEST(CameraOffsets, OfFileTimesAreThoseOfTheFilesBeginnings) {
  std::vector<v1::VideoFacts> videos = {VideoAt("a", {500, 540}), VideoAt("b", {250, 290})};
  for (v1::VideoFacts& video : videos) {
    video.set_begin_pts(video.frame_pts(0));
    video.set_created_unix_ns(1'700'000'000'000'000'000);
  }
  videos[1].set_created_unix_ns(1'700'000'003'500'000'000);
  const auto syncs = OffsetsByFileTimes(videos);
  ASSERT_TRUE(syncs.ok()) << syncs.status();
  ASSERT_EQ(syncs->size(), 2u);
  EXPECT_NEAR((*syncs)[0].offset_s(), -0.5, 1e-9);
  EXPECT_NEAR((*syncs)[1].offset_s(), 3.25, 1e-9);
  EXPECT_NEAR((*syncs)[1].offset_sigma_s(), 1 / std::sqrt(12), 1e-9);  // even within a second
  EXPECT_EQ((*syncs)[1].found_by(), "file-times");
  videos[1].set_path("b.mov");
  videos[1].clear_created_unix_ns();
  const absl::Status without = OffsetsByFileTimes(videos).status();
  EXPECT_TRUE(absl::IsFailedPrecondition(without));
  EXPECT_EQ(without.message(), "b.mov: does not say when it was filmed; use --sync motion or together");
  const std::vector<v1::CameraSync> together = OffsetsTogether(videos);
  ASSERT_EQ(together.size(), 2u);
  EXPECT_NEAR(together[0].offset_s(), -0.5, 1e-9);
  EXPECT_NEAR(together[1].offset_s(), -0.25, 1e-9);
  EXPECT_EQ(together[1].offset_sigma_s(), 0);
  EXPECT_EQ(together[1].found_by(), "together");
}

TEST(CameraOffsets, DescribeTheTimesOfAVideo) {
  v1::CameraSync even, uneven;
  v1::VideoFacts video = VideoAt("a", {0, 40, 80, 120});
  video.set_timecode("10:00:00:24");
  video.set_timecode_at_s(-0.04);  // the frame before the first one
  DescribeTimes(video, even);
  EXPECT_EQ(even.timecode(), "10:00:01:00");
  EXPECT_NEAR(even.period_ms(), 40, 1e-9);
  EXPECT_EQ(even.frames(), 4u);
  EXPECT_EQ(even.shortest_ms(), 0);
  EXPECT_EQ(even.longest_ms(), 0);
  video = VideoAt("a", {0, 40, 70, 110, 170, 210});
  video.set_timecode("what the camera says");
  DescribeTimes(video, uneven);
  EXPECT_EQ(uneven.timecode(), "what the camera says");
  EXPECT_NEAR(uneven.period_ms(), 40, 1e-9);
  EXPECT_NEAR(uneven.shortest_ms(), 30, 1e-9);
  EXPECT_NEAR(uneven.longest_ms(), 60, 1e-9);
}

// 2.1 ms, or 2 % of a long period.
TEST(CameraOffsets, ARateVariesWhereADistanceIsOffByMoreThanRounding) {
  const auto varies = [](const std::vector<int64_t>& pts_us) {
    v1::VideoFacts facts = VideoAt("a", pts_us);
    facts.set_time_base_den(1'000'000);
    return HasVariableRate(facts);
  };
  EXPECT_FALSE(varies({0, 40'000, 80'000, 122'050, 162'050, 202'050}));
  EXPECT_TRUE(varies({0, 40'000, 80'000, 122'150, 162'150, 202'150}));
  EXPECT_FALSE(varies({0, 40'000, 80'000, 117'950, 157'950, 197'950}));
  EXPECT_TRUE(varies({0, 40'000, 80'000, 117'850, 157'850, 197'850}));
  EXPECT_FALSE(varies({0, 1'000'000, 2'000'000, 3'019'900, 4'019'900, 5'019'900}));
  EXPECT_TRUE(varies({0, 1'000'000, 2'000'000, 3'020'100, 4'020'100, 5'020'100}));
  EXPECT_FALSE(varies({7}));
}

TEST(CameraOffsets, TellAVariableRateFromRounding) {
  EXPECT_FALSE(HasVariableRate(VideoAt("a", {0, 33, 67, 100, 133})));
  EXPECT_TRUE(HasVariableRate(VideoAt("a", {0, 33, 67, 117, 150})));
}

}  // namespace
}  // namespace weft
