#include "services/results/export/export_folder.h"

#include <gmock/gmock.h>

#include <filesystem>

#include "services/formats/files/atomic_file.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using Holds = ExportFolder::Holds;

class ExportFolderTest : public ::testing::Test {
 protected:
  ExportFolderTest() { wanted_.add_files("garment.glb"); }
  ~ExportFolderTest() override { std::filesystem::remove_all(folder_.path()); }

  const ExportFolder folder_{::testing::TempDir() + "/export_folder_" + std::to_string(getpid())};
  v1::Export wanted_;
};

TEST_F(ExportFolderTest, KnowsHowFarAnExportCame) {
  EXPECT_EQ(*folder_.Compare(wanted_), Holds::kNothing);
  ASSERT_TRUE(folder_.Begin(wanted_).ok());
  EXPECT_EQ(*folder_.Compare(wanted_), Holds::kPart);
  EXPECT_FALSE(folder_.Checkpoint().has_value());
  v1::ExportCheckpoint checkpoint;
  checkpoint.set_bytes(7);
  checkpoint.add_state(0.1);
  ASSERT_TRUE(folder_.WriteCheckpoint(checkpoint).ok());
  EXPECT_EQ(folder_.Checkpoint()->state(0), 0.1);
  ASSERT_TRUE(WriteFileAtomically(folder_.UnfinishedOf("garment.glb"), "all").ok());
  ASSERT_TRUE(folder_.Publish("garment.glb").ok());
  ASSERT_TRUE(folder_.Finish(wanted_).ok());
  EXPECT_EQ(*folder_.Compare(wanted_), Holds::kAll);
  EXPECT_FALSE(std::filesystem::exists(folder_.UnfinishedOf("")));
}

TEST_F(ExportFolderTest, IsNotSharedByTwoExports) {
  ASSERT_TRUE(folder_.Begin(wanted_).ok());
  wanted_.set_fps(50);
  EXPECT_THAT(folder_.Compare(wanted_).status().message(), HasSubstr("another export stands here"));
}

TEST_F(ExportFolderTest, KeepsFilesOfOthers) {
  ASSERT_TRUE(CreateFolders(folder_.path()).ok());
  ASSERT_TRUE(WriteFileAtomically(folder_.Of("garment.glb"), "of an artist").ok());
  EXPECT_THAT(folder_.Compare(wanted_).status().message(), HasSubstr("is of no export"));
}

TEST_F(ExportFolderTest, SaysWhatIsNeededAndWhatIsFree) {
  EXPECT_TRUE(folder_.CheckRoom(1, 0).ok());
  const absl::Status status = folder_.CheckRoom(uint64_t{1} << 60, 0);
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(status.message(), HasSubstr("needs up to 1152921"));
  EXPECT_THAT(status.message(), HasSubstr("are free"));
  EXPECT_TRUE(folder_.CheckRoom(uint64_t{1} << 60, uint64_t{1} << 60).ok());
}

}  // namespace
}  // namespace weft
