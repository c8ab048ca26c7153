#include "services/studio/calibration/detect_boards.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "capture/image/image_file.h"
#include "capture/take/open_dump.h"
#include "services/formats/files/rig_file.h"
#include "services/studio/calibration/rehearsal.h"
#include "tests/capture/calibration/simulated_calibration.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/studio/recording/recorded_pattern.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

void PutGrey(const std::string& path, int width_px, int height_px) {
  Frame frame;
  frame.width_px = width_px;
  frame.height_px = height_px;
  frame.format = PixelFormat::kGrey8;
  frame.pixels =
      std::make_shared<const std::vector<uint8_t>>(static_cast<size_t>(width_px * height_px), uint8_t{90});
  fs::create_directories(fs::path(path).parent_path());
  ASSERT_TRUE(WriteImageFile(path, frame).ok());
}

TEST(CamerasOfDump, HaveTheSizesOfTheirImages) {
  const TempFolder folder;
  PutGrey(folder / "dump/0000/c10.png", 40, 30);
  PutGrey(folder / "dump/0000/c9.png", 20, 50);
  const auto rig = CamerasOfDump(folder / "dump");
  ASSERT_TRUE(rig.ok()) << rig.status();
  ASSERT_EQ(rig->cameras.size(), 2u);
  EXPECT_EQ(rig->cameras[0].id, "c9");  // in the order of their numbers
  EXPECT_EQ(rig->cameras[0].width_px, 20);
  EXPECT_EQ(rig->cameras[0].height_px, 50);
  EXPECT_EQ(rig->cameras[0].fx_px, 50);
  EXPECT_EQ(rig->cameras[0].fy_px, 50);
  EXPECT_EQ(rig->cameras[1].fx_px, 40);
  EXPECT_EQ(rig->cameras[1].cx_px, 19.5);
  EXPECT_EQ(rig->cameras[1].cy_px, 14.5);
}

// The first image that can be read tells the size.
TEST(CamerasOfDump, PassOverImagesThatCannotBeRead) {
  const TempFolder folder;
  WriteBytes(folder / "dump/0000/a.png", "no image");
  EXPECT_FALSE(CamerasOfDump(folder / "dump").ok());
  PutGrey(folder / "dump/0001/a.png", 40, 30);
  WriteBytes(folder / "dump/0002/a.png", "no image");
  const auto rig = CamerasOfDump(folder / "dump");
  ASSERT_TRUE(rig.ok()) << rig.status();
  EXPECT_EQ(rig->cameras[0].width_px, 40);
}

TEST(CamerasOfDump, OfATakeAreThoseThatHaveAFrame) {
  const TempFolder folder;
  PatternFrames cameras({"left", "right"}, 64, 48);
  std::vector<RawFrameSet> sets{cameras.Set(0), cameras.Set(1)};
  sets[0].frames.pop_back();
  sets[0].missing.push_back({"right", "late"});
  RecordSets(folder / "take", cameras.camera_ids(), sets);
  const auto rig = CamerasOfDump(folder / "take");
  ASSERT_TRUE(rig.ok()) << rig.status();
  ASSERT_EQ(rig->cameras.size(), 2u);
  EXPECT_EQ(rig->cameras[1].id, "right");
  EXPECT_EQ(rig->cameras[1].width_px, 64);
  RecordSets(folder / "empty", cameras.camera_ids(), {});
  const absl::Status empty = CamerasOfDump(folder / "empty").status();
  EXPECT_TRUE(absl::IsInvalidArgument(empty));
  EXPECT_THAT(std::string(empty.message()), HasSubstr("empty: holds no images of any camera"));
}

// Two cameras of the rehearsal, two frames.
class DetectBoardsTest : public ::testing::Test {
 protected:
  DetectBoardsTest() {
    target_ = {"one", {MakeBoard("A", 0, 5, 4, 28)}, {}};
    target_.boards[0].gap_mm = 7;
    RehearsalOptions options;
    options.rig = {.cameras = 2,
                   .width_px = 400,
                   .height_px = 320,
                   .distance_mm = 1000,
                   .around_deg = 30,
                   .object_width_mm = 380,
                   .object_height_mm = 300};
    options.motion = {.frames = 2, .reach_mm = {20, 20, 20}, .seed = 3};
    options.look.samples = 2;
    const absl::Status status = WriteRehearsal(Dump(), target_, options, [this](size_t done, size_t all) {
      EXPECT_LE(done, all);
      EXPECT_EQ(all, 4u);
      ++rendered_;
    });
    EXPECT_TRUE(status.ok()) << status;
  }
  std::string Dump() const { return folder_ / "boards"; }
  BoardDetection Detect() {
    const auto rig = CamerasOfDump(Dump());
    EXPECT_TRUE(rig.ok()) << rig.status();
    const auto dump = OpenDump(Dump(), *rig);
    EXPECT_TRUE(dump.ok()) << dump.status();
    images_ = 0;
    auto found = DetectBoards(**dump, *rig, target_, {}, {0, 1}, [this](size_t, size_t all) {
      EXPECT_EQ(all, 4u);
      ++images_;
    });
    EXPECT_TRUE(found.ok()) << found.status();
    return found.value_or(BoardDetection());
  }

  const TempFolder folder_;
  CalibrationTarget target_;
  std::atomic<int> rendered_ = 0, images_ = 0;
};

TEST_F(DetectBoardsTest, LooksAtEveryImage) {
  EXPECT_EQ(rendered_, 4);
  const auto truth = ReadRig(Dump() + "/truth/rig.json");
  ASSERT_TRUE(truth.ok()) << truth.status();
  EXPECT_EQ(truth->cameras.size(), 2u);
  const BoardDetection found = Detect();
  EXPECT_EQ(images_, 4);
  EXPECT_THAT(found.warnings, ElementsAre());
  EXPECT_THAT(found.views.frames, ElementsAre("0000", "0001"));
  ASSERT_EQ(found.views.cameras.size(), 2u);
  EXPECT_EQ(found.views.cameras[0].id, truth->cameras[0].id);
  EXPECT_EQ(found.views.cameras[0].width_px, 400);
  EXPECT_EQ(found.views.cameras[0].height_px, 320);
  EXPECT_GE(found.views.boards.size(), 3u);
  for (const BoardView& view : found.views.boards) {
    EXPECT_EQ(view.board, 0);
    EXPECT_EQ(view.corners.size() % 4, 0u);
  }
  for (const CameraSightings& camera : found.sightings) {
    EXPECT_EQ(camera.images, 2);
    EXPECT_GT(camera.tags, 0);
    EXPECT_LE(camera.tags, 2 * 20);
    EXPECT_FALSE(camera.mirrored);
  }
}

TEST_F(DetectBoardsTest, TellsImagesThatCannotBeReadAndThoseThatAreMirrored) {
  const std::string id = CamerasOfDump(Dump())->cameras[0].id;
  // The other camera's images, left and right exchanged.
  const std::string other = CamerasOfDump(Dump())->cameras[1].id;
  for (const char* frame : {"0000", "0001"}) {
    const std::string path = Dump() + "/" + frame + "/" + other + ".png";
    const auto image = ReadImageFile(path);
    ASSERT_TRUE(image.ok()) << image.status();
    Frame mirrored = *image;
    std::vector<uint8_t> pixels(image->pixels->size());
    const auto channels = static_cast<int>(pixels.size() / static_cast<size_t>(400 * 320));
    for (int y = 0; y < 320; ++y)
      for (int x = 0; x < 400; ++x)
        for (int c = 0; c < channels; ++c)
          pixels[static_cast<size_t>((y * 400 + x) * channels + c)] =
              (*image->pixels)[static_cast<size_t>((y * 400 + 399 - x) * channels + c)];
    mirrored.pixels = std::make_shared<const std::vector<uint8_t>>(std::move(pixels));
    ASSERT_TRUE(WriteImageFile(path, mirrored).ok());
  }
  WriteBytes(Dump() + "/0001/" + id + ".png", "no image");
  const BoardDetection found = Detect();
  ASSERT_EQ(found.warnings.size(), 1u);
  EXPECT_THAT(found.warnings[0], HasSubstr("camera " + id + ", frame 0001: "));
  EXPECT_EQ(found.sightings[0].images, 1);
  EXPECT_FALSE(found.sightings[0].mirrored);
  EXPECT_EQ(found.sightings[1].images, 2);
  EXPECT_EQ(found.sightings[1].tags, 0);
  EXPECT_TRUE(found.sightings[1].mirrored);
}

TEST_F(DetectBoardsTest, RefusesFamiliesThatNobodyKnows) {
  target_.boards[0].family = "tag7";
  const auto rig = CamerasOfDump(Dump());
  const auto dump = OpenDump(Dump(), *rig);
  EXPECT_TRUE(absl::IsInvalidArgument(DetectBoards(**dump, *rig, target_, {}, {0}).status()));
}

}  // namespace
}  // namespace weft
