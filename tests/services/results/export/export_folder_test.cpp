#include "services/results/export/export_folder.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <set>

#include "services/formats/files/atomic_file.h"
#include "tests/capture/temp_folder.h"

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

TEST_F(ExportFolderTest, WhatIsThereIsNamed) {
  const std::string path = folder_.Of("");
  ASSERT_TRUE(folder_.Begin(wanted_).ok());
  const std::string manifest = folder_.UnfinishedOf("export.json");
  v1::Export other = wanted_;
  other.set_fps(50);
  EXPECT_EQ(folder_.Compare(other).status(),
            absl::FailedPreconditionError(manifest +
                                          ": another export stands here (other frames, options or results); "
                                          "choose another --out, or remove the folder"));
  ASSERT_TRUE(WriteFileAtomically(manifest, "{").ok());
  EXPECT_EQ(folder_.Compare(wanted_).status(),
            absl::FailedPreconditionError(manifest +
                                          ": another export stands here, and cannot be read; choose another "
                                          "--out, or remove the folder"));
  std::filesystem::remove(manifest);
  for (const char* name : {"0001.ply", "0001.normal.png"}) {
    v1::Export frames;
    v1::ExportedFrame& frame = *frames.add_frames();
    frame.set_file("0001.ply"), frame.set_normal_map("0001.normal.png");
    EXPECT_EQ(*folder_.Compare(frames), Holds::kNothing);
    ASSERT_TRUE(WriteFileAtomically(folder_.Of(name), "of an artist").ok());
    EXPECT_EQ(folder_.Compare(frames).status(),
              absl::FailedPreconditionError(
                  folder_.Of(name) + ": stands here already, and is of no export; choose another --out"));
    std::filesystem::remove(folder_.Of(name));
  }
}

TEST_F(ExportFolderTest, AStopTellsHowFarItCame) {
  EXPECT_EQ(StoppedAfter(3, 8),
            absl::CancelledError("stopped after 3 of 8 frames; the same command goes on from there"));
}

TEST_F(ExportFolderTest, LeftoversOfItsOwnFilesAreRemoved) {
  ASSERT_TRUE(CreateFolders(folder_.path()).ok());
  const std::string own = "garment.glb.tmp.12345678.1", manifest = "export.json.tmp.12345678.1";
  const std::string other = "other.glb.tmp.12345678.1";
  ASSERT_TRUE(IsTemporaryNameOf(own, "garment.glb")) << "as WriteFileAtomically names them";
  for (const std::string& name :
       {own, manifest, other, std::string("garment.glb"), std::string("garment.glb.tmp.x y")})
    WriteBytes(folder_.Of(name), "x");
  folder_.RemoveLeftovers(wanted_);
  std::set<std::string> left;
  for (const auto& entry : std::filesystem::directory_iterator(folder_.path()))
    left.insert(entry.path().filename().string());
  EXPECT_THAT(left, ::testing::ElementsAre("garment.glb", "garment.glb.tmp.x y", other));
}

TEST_F(ExportFolderTest, BeginsOrGoesOnWhereThereIsRoom) {
  EXPECT_EQ(folder_.BeginOrGoOn(wanted_, uint64_t{1} << 60).status().code(),
            absl::StatusCode::kResourceExhausted);
  EXPECT_FALSE(std::filesystem::exists(folder_.path()));
  EXPECT_EQ(*folder_.BeginOrGoOn(wanted_, 1), Holds::kNothing);
  EXPECT_EQ(*folder_.BeginOrGoOn(wanted_, 1), Holds::kPart);
  ASSERT_TRUE(folder_.Finish(wanted_).ok());
  EXPECT_EQ(*folder_.BeginOrGoOn(wanted_, uint64_t{1} << 60), Holds::kAll) << "needs no room";
  v1::Export other;
  EXPECT_EQ(folder_.BeginOrGoOn(other, 1).status().code(), absl::StatusCode::kFailedPrecondition);
}

TEST_F(ExportFolderTest, RoomIsToldWithItsUnit) {
  const auto told = [&](uint64_t bytes) { return std::string(folder_.CheckRoom(bytes, 0).message()); };
  EXPECT_THAT(told(uint64_t{1} << 60),
              ::testing::StartsWith(folder_.path() + ": the export needs up to 1152921504.62 "
                                                     "GB, "));
  EXPECT_THAT(told(uint64_t{1} << 60),
              ::testing::EndsWith("are free; make room, choose another disk with --out, or "
                                  "fewer frames with --frames"));
}

}  // namespace
}  // namespace weft
