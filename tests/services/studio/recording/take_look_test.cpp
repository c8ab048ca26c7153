#include "services/studio/recording/take_look.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <span>

#include "capture/image/image_decoders.h"
#include "capture/take/take_files.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/studio/recording/recorded_pattern.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

class TakeLookTest : public ::testing::Test {
 protected:
  std::vector<v1::CameraLook> Looks(const TakeLookOptions& options = {}) const {
    auto looks = LookAtTake(take_, options);
    EXPECT_TRUE(looks.ok()) << looks.status();
    return looks.value_or(std::vector<v1::CameraLook>());
  }
  static DecodedImage Picture(const v1::CameraLook& look) {
    const auto* bytes = reinterpret_cast<const uint8_t*>(look.jpeg().data());
    auto image = DecodeJpeg(std::span(bytes, look.jpeg().size()), JpegOrigin::kFile);
    EXPECT_TRUE(image.ok()) << image.status();
    return image.ok() ? *image : DecodedImage();
  }

  const TempFolder folder_;
  const std::string take_ = folder_ / "take";
  PatternFrames cameras_{{"left", "right"}, 64, 48};
};

TEST_F(TakeLookTest, ShowsTheNewestSetOfEveryCamera) {
  RecordPattern(take_, cameras_);
  const std::vector<v1::CameraLook> looks = Looks();
  ASSERT_THAT(looks, SizeIs(2));
  for (const v1::CameraLook& look : looks) {
    EXPECT_EQ(look.problem(), "");
    EXPECT_EQ(look.set(), 8u);
    EXPECT_EQ(look.camera().width_px(), 64);
    EXPECT_EQ(look.camera().height_px(), 48);
    EXPECT_EQ(look.camera().pixel_format(), "BayerRG8");
    // Noise of all values alike.
    EXPECT_NEAR(look.clipped_share(), 2.0 / 256, 0.01);
    EXPECT_NEAR(look.dark_share(), 5.0 / 256, 0.01);
    EXPECT_NEAR(look.median_value(), 128, 8);
    EXPECT_GT(look.focus(), 0.1);
    EXPECT_EQ(Picture(look).width_px, 64);  // never larger than it was
    EXPECT_EQ(Picture(look).height_px, 48);
    EXPECT_EQ(Picture(look).channels, 3);
  }
  EXPECT_EQ(looks[0].camera().id(), "left");
  EXPECT_EQ(looks[1].camera().id(), "right");
  EXPECT_EQ(TakeLookOptions().width_px, 640);
}

TEST_F(TakeLookTest, ReducesPicturesToTheWidth) {
  RecordPattern(take_, cameras_);
  const std::vector<v1::CameraLook> looks = Looks({.camera_id = "right", .width_px = 32, .frame = {}});
  ASSERT_THAT(looks, SizeIs(1));
  EXPECT_EQ(looks[0].camera().id(), "right");
  EXPECT_EQ(looks[0].camera().width_px(), 64);
  EXPECT_EQ(Picture(looks[0]).width_px, 32);
  EXPECT_EQ(Picture(looks[0]).height_px, 24);
}

TEST_F(TakeLookTest, KeepsWhatTheTakeSaysOfACamera) {
  RecordPattern(take_, cameras_);
  v1::Take take = ReadTakeFile(take_).value();
  take.add_cameras()->set_id("left");
  take.mutable_cameras(0)->set_model("Model 7");
  take.add_cameras()->set_id("another");
  ASSERT_TRUE(WriteTakeFile(take_, take).ok());
  const std::vector<v1::CameraLook> looks = Looks();
  ASSERT_THAT(looks, SizeIs(2));
  EXPECT_EQ(looks[0].camera().model(), "Model 7");
  EXPECT_EQ(looks[1].camera().model(), "");
}

TEST_F(TakeLookTest, AnOlderFrameStandsInForOneThatIsMissing) {
  std::vector<RawFrameSet> sets{cameras_.Set(0), cameras_.Set(1)};
  sets[1].frames.pop_back();
  sets[1].missing.push_back({"right", "3 packets lost"});
  RecordSets(take_, cameras_.camera_ids(), sets);
  const std::vector<v1::CameraLook> looks = Looks();
  ASSERT_THAT(looks, SizeIs(2));
  EXPECT_EQ(looks[0].set(), 1u);
  EXPECT_EQ(looks[1].set(), 0u);
  EXPECT_EQ(looks[1].problem(), "");
}

// A camera that was away for 100 sets has none.
TEST_F(TakeLookTest, LooksBackAHundredSets) {
  for (const uint64_t away : {uint64_t{99}, uint64_t{100}}) {
    std::vector<RawFrameSet> sets{cameras_.Set(0)};
    for (uint64_t number = 1; number <= away; ++number) {
      sets.push_back(cameras_.Set(number));
      sets.back().frames.pop_back();
      sets.back().missing.push_back({"right", "unplugged"});
    }
    const std::string take = folder_ / std::to_string(away);
    RecordSets(take, cameras_.camera_ids(), sets);
    const auto looks = LookAtTake(take, {.camera_id = "right", .width_px = 32, .frame = {}});
    ASSERT_TRUE(looks.ok()) << looks.status();
    EXPECT_EQ((*looks)[0].problem(), away == 99 ? "" : "unplugged");
    EXPECT_EQ((*looks)[0].jpeg().empty(), away == 100);
  }
}

TEST_F(TakeLookTest, OfAFrameThatIsNamedShowsThatOneAlone) {
  RecordPattern(take_, cameras_);
  EXPECT_EQ(Looks({.camera_id = "left", .width_px = 32, .frame = "0006"})[0].set(), 6u);
  const v1::CameraLook missing = Looks({.camera_id = "right", .width_px = 32, .frame = "0006"})[0];
  EXPECT_EQ(missing.problem(), "3 packets lost");
  EXPECT_TRUE(missing.jpeg().empty());
  const absl::Status unknown = LookAtTake(take_, {.camera_id = {}, .width_px = 32, .frame = "0009"}).status();
  EXPECT_TRUE(absl::IsNotFound(unknown));
  EXPECT_THAT(std::string(unknown.message()), HasSubstr("has no frame set \"0009\""));
}

TEST_F(TakeLookTest, SaysWhatIsNotThere) {
  EXPECT_TRUE(absl::IsNotFound(LookAtTake(take_, {}).status()));
  RecordPattern(take_, cameras_);
  const absl::Status unknown = LookAtTake(take_, {.camera_id = "top", .width_px = 32, .frame = {}}).status();
  EXPECT_TRUE(absl::IsNotFound(unknown));
  EXPECT_THAT(std::string(unknown.message()), HasSubstr("has no camera \"top\""));
  RecordSets(folder_ / "empty", cameras_.camera_ids(), {});
  const absl::Status empty = LookAtTake(folder_ / "empty", {}).status();
  EXPECT_TRUE(absl::IsFailedPrecondition(empty));
  EXPECT_THAT(std::string(empty.message()), HasSubstr("has no frame set yet"));
}

}  // namespace
}  // namespace weft
