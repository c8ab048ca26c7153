#include "services/work/pipeline/frame_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

class FrameFolderTest : public ::testing::Test {
 protected:
  static FrameFolder::Writer Text(const std::string& text) {
    return [text](const std::string& path) {
      WriteBytes(path, text);
      return absl::OkStatus();
    };
  }

  const TempFolder temp_;
  const FrameFolder folder_ = FrameFolder::Open(std::filesystem::canonical(temp_.path()).string() + "/out",
                                                "f", ConfinedFolder::IfMissing::kMake)
                                  .value();
  v1::FrameReport report_;
};

TEST_F(FrameFolderTest, ListsWhatIsPutAndNotWhatIsDropped) {
  ASSERT_TRUE(folder_.Put(FrameFile::kMesh, Text("mesh"), report_).ok());
  ASSERT_TRUE(folder_.Put(FrameFile::kCloud, Text("cloud"), report_).ok());
  ASSERT_TRUE(folder_.Put(FrameFile::kMesh, Text("another"), report_).ok());
  ASSERT_TRUE(folder_.Drop(FrameFile::kCloud, report_).ok());
  ASSERT_TRUE(folder_.Commit(report_).ok());
  const auto back = folder_.Report();
  ASSERT_TRUE(back.ok()) << back.status();
  ASSERT_EQ(back->files_size(), 1);
  EXPECT_EQ(back->files(0).name(), "mesh.ply");
  EXPECT_EQ(back->files(0).bytes(), 7);
  EXPECT_TRUE(Lists(*back, FrameFile::kMesh));
  EXPECT_FALSE(Lists(*back, FrameFile::kCloud));
  EXPECT_EQ(folder_.CheckAll(*back), "");
}

TEST_F(FrameFolderTest, NamesTheFirstFileThatIsNotAsItWasWritten) {
  ASSERT_TRUE(folder_.Put(FrameFile::kMesh, Text("mesh"), report_).ok());
  WriteBytes(folder_.PathOf(FrameFile::kMesh), "mush");
  EXPECT_EQ(folder_.CheckAll(report_), "mesh.ply is not as it was written");
  std::filesystem::remove(folder_.path() + "/mesh.ply");
  EXPECT_EQ(folder_.CheckAll(report_), "mesh.ply is missing");
  ASSERT_TRUE(folder_.Drop(FrameFile::kMesh, report_).ok());
  WriteBytes(folder_.PathOf(FrameFile::kCloud), "of another run");
  EXPECT_EQ(folder_.CheckAll(report_), "cloud.ply is not of this run");
}

TEST_F(FrameFolderTest, WithoutAReportNothingIsComplete) {
  EXPECT_EQ(folder_.Report().status().code(), absl::StatusCode::kNotFound);
  ASSERT_TRUE(folder_.Put(FrameFile::kMesh, Text("mesh"), report_).ok());
  ASSERT_TRUE(folder_.Commit(report_).ok());
  ASSERT_TRUE(folder_.Clear().ok());
  EXPECT_EQ(folder_.Report().status().code(), absl::StatusCode::kNotFound);
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

}  // namespace
}  // namespace weft
