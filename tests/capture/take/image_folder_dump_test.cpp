#include "capture/take/image_folder_dump.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/image/image_file.h"
#include "capture/take/image_folder.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

Rig TwoPlainCameras() {
  Rig rig;
  for (const char* id : {"400002", "400004"}) {
    CameraModel camera;
    camera.id = id;
    camera.width_px = 16;
    camera.height_px = 12;
    camera.fx_px = camera.fy_px = 20;
    rig.cameras.push_back(camera);
  }
  return rig;
}

void WriteImage(const std::string& path, int width = 16, uint8_t value = 0) {
  std::filesystem::create_directories(std::filesystem::path(path).parent_path());
  Frame frame;
  frame.width_px = width;
  frame.height_px = 12;
  frame.pixels = std::make_shared<const std::vector<uint8_t>>(width * 12, value);
  ASSERT_TRUE(WriteImageFile(path, frame).ok());
}

TEST(ImageFolderDump, ReadsAFolderPerFrame) {
  const TempFolder dump;
  WriteImage(dump / "0010/400004.png", 16, 7);
  WriteImage(dump / "0010/400002.tif", 16, 5);
  WriteImage(dump / "0009/400002.png");
  WriteImage(dump / "0009/400004.png");
  WriteBytes(dump / "truth/notes.txt", "no image");
  const auto source = ImageFolderDump::Open(dump.path(), TwoPlainCameras());
  ASSERT_TRUE(source.ok()) << source.status();
  EXPECT_THAT((*source)->frame_names(), ElementsAre("0009", "0010"));
  EXPECT_THAT((*source)->warnings(), ElementsAre());
  const auto set = (*source)->Read(1);
  ASSERT_TRUE(set.ok());
  ASSERT_EQ(set->frames.size(), 2u);
  EXPECT_EQ(set->frames[0].camera_id, "400002");  // in the rig's order
  EXPECT_EQ(set->frames[0].row(0)[0], 5);
  EXPECT_EQ(set->frames[1].row(0)[0], 7);
}

TEST(ImageFolderDump, NamesThatAreNoTextAreLeftOutAndNamedInEscapedBytes) {
  const TempFolder dump;
  WriteImage(dump / "0009/400002.png");
  WriteImage(dump / "0009/c\xff\xfe.png");
  WriteImage(dump / "00\xc3/400002.png");
  WriteImage(dump / "J\xc3\xbcrgen/400004.png");
  const auto source = ImageFolderDump::Open(dump.path(), TwoPlainCameras());
  ASSERT_TRUE(source.ok()) << source.status();
  EXPECT_THAT((*source)->frame_names(), ElementsAre("0009", "J\xc3\xbcrgen"));
  EXPECT_THAT((*source)->warnings(),
              ElementsAre(HasSubstr("/0009/c\\xff\\xfe.png and 1 more: the name is not")));
  EXPECT_THAT((*source)->warnings(), ElementsAre(HasSubstr("rename it")));
  EXPECT_EQ(ListImageFolder(dump.path()).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(ImageFolderDump, ADumpOfSuchNamesAloneSaysSo) {
  const TempFolder dump;
  WriteImage(dump / "0009/\x1b[2J.png");
  const auto source = ImageFolderDump::Open(dump.path(), TwoPlainCameras());
  EXPECT_EQ(source.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(source.status().message()), HasSubstr("/0009/\\x1b[2J.png: the name is not"));
}

TEST(ImageFolderDump, ReadsAFolderPerCameraAndOrdersNumbersByValue) {
  const TempFolder dump;
  for (const char* frame : {"9", "10", "100"}) {
    WriteImage(dump / ("cam400002/image" + std::string(frame) + ".png"));
    WriteImage(dump / ("cam400004/image" + std::string(frame) + ".png"));
  }
  const auto source = ImageFolderDump::Open(dump.path(), TwoPlainCameras());
  ASSERT_TRUE(source.ok()) << source.status();
  EXPECT_THAT((*source)->frame_names(), ElementsAre("9", "10", "100"));
  EXPECT_EQ((*source)->Read(2)->frames.size(), 2u);
}

TEST(ImageFolderDump, ReportsMissingBrokenAndMisfittingImagesWithTheReason) {
  const TempFolder dump;
  WriteImage(dump / "0/400002.png");
  WriteImage(dump / "1/400002.png");
  WriteImage(dump / "1/400004.png", 20);
  WriteImage(dump / "2/400002.png");
  WriteBytes(dump / "2/400004.png", ReadBytes(dump / "2/400002.png").substr(0, 40));
  const auto source = ImageFolderDump::Open(dump.path(), TwoPlainCameras());
  ASSERT_TRUE(source.ok()) << source.status();
  const std::string reasons[] = {"no image in the dump", "image is 20x12, the rig says 16x12", "truncated"};
  for (int i = 0; i < 3; ++i) {
    const auto set = (*source)->Read(i);
    ASSERT_TRUE(set.ok());
    EXPECT_EQ(set->frames.size(), 1u);
    ASSERT_EQ(set->missing.size(), 1u);
    EXPECT_EQ(set->missing[0].camera_id, "400004");
    EXPECT_THAT(set->missing[0].reason, HasSubstr(reasons[i]));
  }
  EXPECT_EQ((*source)->Read(3).status().code(), absl::StatusCode::kOutOfRange);
}

TEST(ImageFolderDump, WarnsOfCamerasThatOnlyOneSideKnows) {
  const TempFolder dump;
  WriteImage(dump / "0/400002.png");
  WriteImage(dump / "0/999999.png");
  const auto source = ImageFolderDump::Open(dump.path(), TwoPlainCameras());
  ASSERT_TRUE(source.ok());
  EXPECT_THAT((*source)->warnings(),
              ElementsAre(HasSubstr("camera 400004 of the rig has no images"),
                          HasSubstr("is not in the rig: 999999; is it the rig of this take?")));
}

TEST(ImageFolderDump, RefusesFoldersWithoutFrames) {
  const TempFolder dump;
  EXPECT_EQ(ImageFolderDump::Open(dump / "nowhere", TwoPlainCameras()).status().code(),
            absl::StatusCode::kNotFound);
  EXPECT_EQ(ImageFolderDump::Open(dump.path(), TwoPlainCameras()).status().code(),
            absl::StatusCode::kInvalidArgument);
  WriteImage(dump / "0/999999.png");
  EXPECT_THAT(std::string(ImageFolderDump::Open(dump.path(), TwoPlainCameras()).status().message()),
              HasSubstr("999999"));
}

}  // namespace
}  // namespace weft
