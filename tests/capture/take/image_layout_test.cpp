#include "capture/take/image_layout.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

using NameSet = std::set<std::string>;

TEST(ImageLayout, FoldersAreFramesAsAgreed) {
  const struct {
    NameSet folders, files;
  } kDumps[] = {{{"0000", "0001"}, {"c00", "c01"}},
                {{"0000", "0001"}, {"400002", "400015"}},
                {{"004396", "004397"}, {"400002", "400015"}},
                {{"frame_1", "frame_2"}, {"1", "2"}},
                {{"pose a", "pose b"}, {"left", "right"}},
                {{"0000", "0001", "template"}, {"c00", "c01", "texture"}},
                {{"1623840123456789012", "1623840123490122345"}, {"cam0", "cam1"}},
                {{"0000"}, {"Kamera", "Handy"}}};
  for (const auto& [folders, files] : kDumps) {
    const LayoutJudgement judgement = JudgeLayout(folders, files, nullptr);
    EXPECT_EQ(judgement.layout, ImageLayout::kFolderPerFrame) << *folders.begin() << "/" << *files.begin();
    EXPECT_FALSE(judgement.is_open) << *folders.begin() << "/" << *files.begin();
    EXPECT_EQ(judgement.why, "");
  }
}

TEST(ImageLayout, NamesTellFoldersOfCameras) {
  const struct {
    NameSet folders, files;
  } kDumps[] = {{{"c00", "c01"}, {"0000", "0001"}},       {{"Cam_1", "Cam_2"}, {"1", "2", "3"}},
                {{"left", "right"}, {"000000"}},          {{"view3"}, {"img_0001", "img_0002"}},
                {{"400002", "400015"}, {"000", "001"}},   {{"400002", "400015"}, {"frame1", "frame2"}},
                {{"cam1", "cam2"}, {"GOPR0001"}},         {{"c00", "c01", "c02", "truth"}, {"0000", "0001"}},
                {{"Garten", "Haus"}, {"00001", "00002"}}, {{"camera1"}, {"1623840123456789012"}}};
  for (const auto& [folders, files] : kDumps) {
    const LayoutJudgement judgement = JudgeLayout(folders, files, nullptr);
    EXPECT_EQ(judgement.layout, ImageLayout::kFolderPerCamera) << *folders.begin() << "/" << *files.begin();
    EXPECT_NE(judgement.why, "");
  }
}

TEST(ImageLayout, SaysWhereNamesLeaveItOpen) {
  const struct {
    NameSet folders, files;
  } kDumps[] = {
      {{"0", "1"}, {"0", "1", "2"}}, {{"0000", "0001"}, {"0000", "0001"}}, {{"c0", "c1"}, {"v0", "v1"}}};
  for (const auto& [folders, files] : kDumps) {
    const LayoutJudgement judgement = JudgeLayout(folders, files, nullptr);
    EXPECT_EQ(judgement.layout, ImageLayout::kFolderPerFrame);
    EXPECT_TRUE(judgement.is_open);
  }
}

TEST(ImageLayout, ARigDecides) {
  const CameraNames words({"a", "b", "c"}), numbers({"0", "1"});
  EXPECT_EQ(JudgeLayout({"a", "b"}, {"x", "y"}, &words).layout, ImageLayout::kFolderPerCamera);
  EXPECT_EQ(JudgeLayout({"A", "B"}, {"c00", "c01"}, &words).layout, ImageLayout::kFolderPerCamera);
  EXPECT_EQ(JudgeLayout({"cam0", "cam1"}, {"a", "b"}, &words).layout, ImageLayout::kFolderPerFrame);
  EXPECT_EQ(JudgeLayout({"0", "1"}, {"0", "1", "2"}, &numbers).layout, ImageLayout::kFolderPerCamera);
  EXPECT_EQ(JudgeLayout({"0", "1", "2"}, {"0", "1"}, &numbers).layout, ImageLayout::kFolderPerFrame);
  EXPECT_TRUE(JudgeLayout({"0", "1"}, {"0", "1"}, &numbers).is_open);
  EXPECT_FALSE(JudgeLayout({"0000", "0001"}, {"0", "1"}, &numbers).is_open);
  EXPECT_EQ(JudgeLayout({"0000"}, {"c00"}, &numbers).layout, ImageLayout::kFolderPerFrame);
}

TEST(ImageLayout, NothingIsNothing) {
  EXPECT_EQ(JudgeLayout({}, {}, nullptr).layout, ImageLayout::kFolderPerFrame);
}

}  // namespace
}  // namespace weft
