#include "services/tools/cli/decode_inputs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <memory>

#include "capture/image/image_file.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/studio/recording/recorded_pattern.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class DecodeInputsTest : public ::testing::Test {
 protected:
  // A grey picture of 8 x 6 px.
  std::string Picture(const std::string& name, uint8_t value) const {
    std::filesystem::create_directories(std::filesystem::path(folder_ / name).parent_path());
    Frame frame;
    frame.width_px = 8;
    frame.height_px = 6;
    frame.pixels = std::make_shared<const std::vector<uint8_t>>(48, value);
    EXPECT_TRUE(WriteImageFile(folder_ / name, frame).ok());
    return folder_ / name;
  }
  static std::vector<std::string> NamesOf(const absl::StatusOr<DecodeInputs>& inputs) {
    EXPECT_TRUE(inputs.ok()) << inputs.status();
    std::vector<std::string> names;
    if (inputs.ok())
      for (const DecodeInput& view : inputs->views) names.push_back(view.name);
    return names;
  }

  const TempFolder folder_;
};

TEST_F(DecodeInputsTest, FilesAreCalledByTheirNamesAndReadWhenTheyAreWanted) {
  const std::string b = Picture("b.png", 20), a = Picture("a.png", 10);
  const auto inputs = FindDecodeInputs({b, a}, "", "");
  EXPECT_THAT(NamesOf(inputs), ElementsAre("b", "a"));
  EXPECT_EQ(inputs->views[1].label, a);
  EXPECT_EQ(inputs->views[1].bytes, std::filesystem::file_size(a));
  const auto frame = inputs->views[1].read();
  ASSERT_TRUE(frame.ok()) << frame.status();
  EXPECT_EQ(frame->row(0)[0], 10);
  std::filesystem::remove(b);
  EXPECT_EQ(inputs->views[0].read().status().code(), absl::StatusCode::kNotFound);
}

TEST_F(DecodeInputsTest, FilesOfOneNameAreCalledByTheirPaths) {
  const std::string one = Picture("one/c1.png", 1), two = Picture("two/c1.png", 2);
  EXPECT_THAT(NamesOf(FindDecodeInputs({one, two}, "", "")), ElementsAre(one, two));
  const absl::Status twice = FindDecodeInputs({one, two, one}, "", "").status();
  EXPECT_EQ(twice.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(twice.message()), AllOf(HasSubstr(one), HasSubstr("given twice")));
}

TEST_F(DecodeInputsTest, ViewsOfOneFrameAreItsCamerasAndThoseOfSeveralHaveTheFrameToo) {
  for (const char* name : {"0000/c1.png", "0000/c2.png", "0001/c1.png", "0001/c2.png"})
    Picture("dump/" + std::string(name), 1);
  const std::string dump = folder_ / "dump";
  EXPECT_THAT(NamesOf(FindDecodeInputs({dump}, "0001", "")), ElementsAre("c1", "c2"));
  EXPECT_THAT(NamesOf(FindDecodeInputs({dump}, "", "")),
              ElementsAre("0000/c1", "0000/c2", "0001/c1", "0001/c2"));
  EXPECT_THAT(FindDecodeInputs({dump}, "0001", "")->views[0].label, ::testing::EndsWith("0001/c1.png"));
  EXPECT_EQ(FindDecodeInputs({dump}, "0007", "").status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(DecodeInputsTest, AGreyFileIsAMosaicOnRequest) {
  const auto inputs = FindDecodeInputs({Picture("a.png", 10)}, "", "bayer_gb8");
  ASSERT_TRUE(inputs.ok()) << inputs.status();
  EXPECT_EQ(inputs->views[0].read()->format, PixelFormat::kBayerGb8);
  EXPECT_EQ(FindDecodeInputs({"a.png"}, "", "bayer").status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(DecodeInputsTest, FramesAreThoseOfOneTakeOrFolder) {
  const absl::Status status = FindDecodeInputs({Picture("a.png", 10)}, "3:5", "").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("--frames is for one take or one folder"));
}

TEST_F(DecodeInputsTest, ATakesViewsAreReadFromItsStreams) {
  PatternFrames cameras({"left", "right"}, 64, 48, RawFormat::kMono8);
  RecordPattern(folder_ / "take", cameras);  // sets 5 to 8; set 6 lacks the last camera
  const auto all = FindDecodeInputs({folder_ / "take"}, "", "");
  ASSERT_TRUE(all.ok()) << all.status();
  ASSERT_EQ(all->views.size(), 8u);
  const auto frame = all->views[0].read();
  ASSERT_TRUE(frame.ok()) << frame.status();
  EXPECT_EQ(frame->width_px, 64);
  const RawFrame recorded = cameras.Frame(0, 5);
  EXPECT_EQ(std::string(frame->pixels->begin(), frame->pixels->end()),
            std::string(reinterpret_cast<const char*>(recorded.bytes->data()), 64 * 48));
  EXPECT_THAT(all->views[3].name, ::testing::EndsWith("/right"));
  EXPECT_FALSE(all->views[3].read().ok());  // of set 6
  EXPECT_THAT(NamesOf(FindDecodeInputs({folder_ / "take"}, "8", "")), ElementsAre("left", "right"));
  const absl::Status mosaic = FindDecodeInputs({folder_ / "take"}, "", "bayer_gb8").status();
  EXPECT_EQ(mosaic.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(mosaic.message()), HasSubstr("--mosaic is for image files"));
}

}  // namespace
}  // namespace weft
