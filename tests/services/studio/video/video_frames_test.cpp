#include "services/studio/video/video_frames.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "services/studio/video/video_facts.h"
#include "tests/services/studio/video/made_video.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Ten frames whose values are 10 to 19.
class VideoFramesTest : public ::testing::Test {
 protected:
  VideoFramesTest() { Look("-c:v ffv1"); }
  void Look(const std::string& options) {
    MakeVideo(temp_ / "a.mkv", Values(10, 10), "25", options);
    auto facts = InspectVideo(std::filesystem::canonical(temp_ / "a.mkv").string());
    ASSERT_TRUE(facts.ok()) << facts.status();
    facts_ = *facts;
    facts_.set_camera("left");
  }
  // The first value of each frame, and how the run ended.
  std::vector<int> Read(const VideoRange& range) {
    std::vector<int> values;
    auto frames = VideoFrames::Start(facts_, range, {});
    end_ = frames.status();
    for (size_t i = 0; end_.ok() && i < range.count; ++i) {
      const auto frame = frames->Next();
      end_ = frame.status();
      if (frame.ok()) values.push_back((*frame->pixels)[0]);
    }
    if (end_.ok()) end_ = frames->Finish();
    return values;
  }
  std::string Why() const { return std::string(end_.message()); }

  const TempFolder temp_;
  v1::VideoFacts facts_;
  absl::Status end_;
};

TEST_F(VideoFramesTest, AreThoseOfTheRange) {
  EXPECT_THAT(Read({0, 10}), ElementsAre(10, 11, 12, 13, 14, 15, 16, 17, 18, 19));
  EXPECT_TRUE(end_.ok()) << end_;
  EXPECT_THAT(Read({3, 2}), ElementsAre(13, 14));
  EXPECT_TRUE(end_.ok()) << end_;
  EXPECT_THAT(Read({9, 1}), ElementsAre(19));
  EXPECT_TRUE(end_.ok()) << end_;
}

TEST_F(VideoFramesTest, AreGreyOrAMosaicOrColours) {
  ASSERT_EQ(VideoPixelFormat(facts_, {}), PixelFormat::kGrey8);
  EXPECT_EQ(VideoPixelFormat(facts_, PixelFormat::kBayerRg8), PixelFormat::kBayerRg8);
  auto frames = VideoFrames::Start(facts_, {0, 1}, PixelFormat::kBayerRg8);
  ASSERT_TRUE(frames.ok()) << frames.status();
  const auto frame = frames->Next();
  ASSERT_TRUE(frame.ok()) << frame.status();
  EXPECT_EQ(frame->format, PixelFormat::kBayerRg8);
  EXPECT_EQ(frame->camera_id, "left");
  EXPECT_EQ(frame->origin, facts_.path());
  EXPECT_EQ(frame->width_px, 32);
  EXPECT_EQ(frame->height_px, 16);
  EXPECT_EQ(frame->pixels->size(), 32u * 16);

  Look("-c:v ffv1 -pix_fmt yuv444p");
  EXPECT_EQ(VideoPixelFormat(facts_, {}), PixelFormat::kRgb8);
  auto colours = VideoFrames::Start(facts_, {0, 1}, {});
  ASSERT_TRUE(colours.ok()) << colours.status();
  EXPECT_EQ(colours->Next()->pixels->size(), 3u * 32 * 16);
  const absl::Status refused = VideoFrames::Start(facts_, {0, 1}, PixelFormat::kBayerRg8).status();
  EXPECT_TRUE(absl::IsInvalidArgument(refused));
  EXPECT_THAT(std::string(refused.message()),
              HasSubstr("a mosaic is named, and the video is in colours (yuv444p)"));
}

// Pictures that are damaged, for example, are in the file and in no range.
TEST_F(VideoFramesTest, LeaveOutPicturesThatAreNotUsed) {
  const v1::VideoFacts all = facts_;
  facts_.clear_frame_pts();
  for (const int i : {0, 1, 3, 4, 6, 7, 8, 9}) facts_.add_frame_pts(all.frame_pts(i));
  facts_.add_unused(2);
  facts_.add_unused(5);
  EXPECT_THAT(Read({0, 8}), ElementsAre(10, 11, 13, 14, 16, 17, 18, 19));
  EXPECT_TRUE(end_.ok()) << end_;
  EXPECT_THAT(Read({1, 3}), ElementsAre(11, 13, 14));
  EXPECT_TRUE(end_.ok()) << end_;
  EXPECT_THAT(Read({4, 2}), ElementsAre(16, 17));
  EXPECT_TRUE(end_.ok()) << end_;
}

TEST_F(VideoFramesTest, SayThatAFileWasChanged) {
  const v1::VideoFacts all = facts_;
  facts_.add_frame_pts(400);
  Read({0, 11});
  EXPECT_TRUE(absl::IsDataLoss(end_)) << end_;
  EXPECT_THAT(Why(), AllOf(HasSubstr(facts_.path() + ": it gives fewer frames than at first"),
                           HasSubstr("ffmpeg -i FILE -c:v ffv1")));
  facts_ = all;
  facts_.mutable_frame_pts()->Truncate(9);
  EXPECT_THAT(Read({0, 5}), ElementsAre(10, 11, 12, 13, 14));
  EXPECT_TRUE(end_.ok()) << "later frames are not looked at: " << end_;
  facts_ = all;
  facts_.set_frame_pts(4, facts_.frame_pts(4) + 1);
  Read({3, 3});
  EXPECT_TRUE(absl::IsDataLoss(end_)) << end_;
  EXPECT_THAT(Why(), HasSubstr("its frames have other times than at first"));
  Read({5, 3});
  EXPECT_TRUE(end_.ok()) << end_;
  Read({0, 4});
  EXPECT_TRUE(end_.ok()) << end_;
}

TEST_F(VideoFramesTest, CompareTheTimesThatFfmpegSays) {
  for (int i = 0; i < 10; ++i) facts_.add_decoded_pts(facts_.frame_pts(i));
  for (int i = 0; i < 10; ++i) facts_.set_frame_pts(i, 7 * i);
  EXPECT_THAT(Read({2, 3}), ElementsAre(12, 13, 14));
  EXPECT_TRUE(end_.ok()) << end_;
  facts_.set_decoded_pts(3, 1);
  Read({2, 3});
  EXPECT_TRUE(absl::IsDataLoss(end_)) << end_;
}

TEST_F(VideoFramesTest, NameAFileThatIsGone) {
  std::filesystem::remove(temp_ / "a.mkv");
  EXPECT_THAT(Read({0, 1}), IsEmpty());
  EXPECT_FALSE(end_.ok());
  EXPECT_THAT(Why(), HasSubstr("a.mkv"));
}

}  // namespace
}  // namespace weft
