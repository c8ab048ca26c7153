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
  EXPECT_THAT(std::string(SyncWayFromName("sound").status().message()), HasSubstr("auto, timecode, ltc"));
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

TEST(CameraOffsets, TellAVariableRateFromRounding) {
  EXPECT_FALSE(HasVariableRate(VideoAt("a", {0, 33, 67, 100, 133})));
  EXPECT_TRUE(HasVariableRate(VideoAt("a", {0, 33, 67, 117, 150})));
}

}  // namespace
}  // namespace weft
