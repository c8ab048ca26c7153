#include "services/studio/recording/proxy_video.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "services/ground/process/ffmpeg_process.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/studio/recording/recorded_pattern.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

// Two cameras, all white and all grey; the second set lacks the grey one.
void RecordPlain(const std::string& folder) {
  std::vector<RawFrameSet> sets;
  for (uint64_t number = 0; number < 4; ++number) {
    RawFrameSet set;
    set.number = number;
    for (const char* id : {"bright", "grey"}) {
      const uint8_t value = id[0] == 'b' ? 255 : 128;
      Frame frame{
          id, 64, 48, PixelFormat::kGrey8, std::make_shared<const std::vector<uint8_t>>(64 * 48, value),
          0,  ""};
      RawFrame raw = *ToRawFrame(frame);
      raw.camera_id = id;
      raw.device_time_ns = static_cast<int64_t>(number) * 40'000'000;
      set.frames.push_back(raw);
    }
    if (number == 1) {
      set.frames.pop_back();
      set.missing.push_back({"grey", "lost"});
    }
    sets.push_back(set);
  }
  RecordSets(folder, {"bright", "grey"}, sets);
}

TEST(ProxyVideo, ShowsAllCamerasSideBySide) {
  const TempFolder temp;
  RecordPlain(temp / "take");
  ProxyOptions options;
  options.camera_width_px = 128;  // larger than the camera's pictures
  const auto sets = ExportProxy(temp / "take", temp / "proxy.mp4", options);
  ASSERT_TRUE(sets.ok()) << sets.status();
  EXPECT_EQ(*sets, 4u);
  auto ffmpeg =
      FfmpegProcess::Start({"-i", temp / "proxy.mp4", "-f", "rawvideo", "-pix_fmt", "gray", "pipe:1"});
  ASSERT_TRUE(ffmpeg.ok()) << ffmpeg.status();
  std::vector<uint8_t> picture(size_t{256} * 96);
  const auto at = [&](size_t x, size_t y) { return static_cast<int>(picture[256 * y + x]); };
  for (int set = 0; set < 4; ++set) {
    ASSERT_TRUE(ffmpeg->Read(picture.data(), picture.size()).ok()) << set;
    EXPECT_NEAR(at(64, 80), 255, 10);
    EXPECT_NEAR(at(192, 80), set == 1 ? 0 : 128, 10);
  }
  EXPECT_FALSE(ffmpeg->Read(picture.data(), 1).ok());
}

TEST(ProxyVideo, CamerasStandInRowsOfASquare) {
  const TempFolder temp;
  const std::vector<std::string> ids = {"a", "b", "c"};
  const uint8_t values[] = {255, 128, 60};
  RawFrameSet set;
  for (size_t i = 0; i < ids.size(); ++i) {
    RawFrame raw = *ToRawFrame({ids[i], 64, 48, PixelFormat::kGrey8,
                                std::make_shared<const std::vector<uint8_t>>(64 * 48, values[i]), 0, ""});
    raw.camera_id = ids[i];
    set.frames.push_back(raw);
  }
  RecordSets(temp / "take", ids, {set});
  ProxyOptions options;
  options.camera_width_px = 128;
  ASSERT_TRUE(ExportProxy(temp / "take", temp / "proxy.mp4", options).ok());
  auto ffmpeg =
      FfmpegProcess::Start({"-i", temp / "proxy.mp4", "-f", "rawvideo", "-pix_fmt", "gray", "pipe:1"});
  ASSERT_TRUE(ffmpeg.ok()) << ffmpeg.status();
  std::vector<uint8_t> picture(size_t{256} * 192);
  ASSERT_TRUE(ffmpeg->Read(picture.data(), picture.size()).ok());
  EXPECT_FALSE(ffmpeg->Read(picture.data(), 1).ok());
  const auto at = [&](size_t x, size_t y) { return static_cast<int>(picture[256 * y + x]); };
  EXPECT_NEAR(at(64, 80), 255, 10);
  EXPECT_NEAR(at(192, 80), 128, 10);
  EXPECT_NEAR(at(64, 176), 60, 10);
  EXPECT_NEAR(at(192, 176), 0, 10);
}

TEST(ProxyVideo, TakesAnyNameForAFile) {
  const TempFolder temp;
  RecordPlain(temp / "take");
  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::current_path(temp / "");
  const auto sets = ExportProxy("take", "-north:1.mp4", {});
  std::filesystem::current_path(before);
  EXPECT_TRUE(sets.ok()) << sets.status();
  EXPECT_TRUE(std::filesystem::exists(temp / "-north:1.mp4"));
}

TEST(ProxyVideo, SaysWhyThereIsNone) {
  const TempFolder temp;
  RecordPlain(temp / "take");
  const absl::Status status = ExportProxy(temp / "take", temp / "proxy.xyz", {}).status();
  EXPECT_THAT(std::string(status.message()), HasSubstr("ffmpeg"));
  EXPECT_THAT(std::string(status.message()), HasSubstr("proxy.unfinished.xyz"));
  EXPECT_FALSE(std::filesystem::exists(temp / "proxy.unfinished.xyz"));
  EXPECT_TRUE(absl::IsInvalidArgument(ExportProxy(temp / "take", temp / "proxy.mp4", {3}).status()));
}

}  // namespace
}  // namespace weft
