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

TEST_F(FrameFolderTest, MeshesHaveNamesAndTopologies) {
  const std::vector<Face> faces = {{0, 1, 2}};
  ASSERT_TRUE(folder_.PutMesh(kGarmentMesh, 3, faces, Text("first"), report_).ok());
  ASSERT_TRUE(folder_.PutMesh("body", 4, faces, Text("body"), report_).ok());
  ASSERT_TRUE(folder_.PutMesh(kGarmentMesh, 3, faces, Text("mesh"), report_).ok());
  EXPECT_EQ(folder_.PutMesh("../body", 3, faces, Text("x"), report_).code(),
            absl::StatusCode::kInvalidArgument);
  ASSERT_TRUE(folder_.Commit(report_).ok());
  const auto back = folder_.Report();
  ASSERT_TRUE(back.ok()) << back.status();
  ASSERT_EQ(back->meshes_size(), 2);
  EXPECT_EQ(back->meshes(0).name(), "body");
  EXPECT_EQ(back->meshes(0).file(), "body.ply");
  EXPECT_EQ(back->meshes(0).vertices(), 4);
  EXPECT_EQ(back->meshes(0).topology_hash(), TopologyHash(4, faces));
  EXPECT_EQ(back->meshes(1).file(), "mesh.ply");
  EXPECT_EQ(folder_.CheckAll(*back), "");
  WriteBytes(folder_.path() + "/body.ply", "nobody");
  EXPECT_EQ(folder_.CheckAll(*back), "body.ply is not as it was written");
  ASSERT_TRUE(folder_.Clear().ok());
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
  ASSERT_TRUE(folder_.DropMesh("body", report_).ok());
  ASSERT_TRUE(folder_.DropMesh(kGarmentMesh, report_).ok());
  EXPECT_EQ(report_.meshes_size() + report_.files_size(), 0);
}

// As they were before meshes had names.
TEST_F(FrameFolderTest, AFrameWithoutNamedMeshesIsComplete) {
  ASSERT_TRUE(folder_.Put(FrameFile::kMesh, Text("mesh"), report_).ok());
  ASSERT_TRUE(folder_.Commit(report_).ok());
  const auto back = folder_.Report();
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->meshes_size(), 0);
  EXPECT_EQ(folder_.CheckAll(*back), "");
}

TEST_F(FrameFolderTest, AReportWithTwoMeshesOfANameIsDamaged) {
  ASSERT_TRUE(folder_.PutMesh("body", 3, {}, Text("body"), report_).ok());
  *report_.add_meshes() = report_.meshes(0);
  ASSERT_TRUE(folder_.Commit(report_).ok());
  EXPECT_EQ(folder_.Report().status().code(), absl::StatusCode::kNotFound);
}

TEST_F(FrameFolderTest, WithoutAReportNothingIsComplete) {
  EXPECT_EQ(folder_.Report().status().code(), absl::StatusCode::kNotFound);
  ASSERT_TRUE(folder_.Put(FrameFile::kMesh, Text("mesh"), report_).ok());
  ASSERT_TRUE(folder_.Commit(report_).ok());
  ASSERT_TRUE(folder_.Clear().ok());
  EXPECT_EQ(folder_.Report().status().code(), absl::StatusCode::kNotFound);
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

TEST_F(FrameFolderTest, AMeshThatIsNotListedIsAProblem) {
  v1::FrameMesh& mesh = *report_.add_meshes();
  mesh.set_name("body");
  mesh.set_file("body.ply");
  EXPECT_EQ(folder_.CheckAll(report_), "body.ply is not listed");
}

TEST_F(FrameFolderTest, ListsSizeAndChecksum) {
  ASSERT_TRUE(folder_.PutMesh("body", 4, {{0, 1, 2}, {0, 2, 3}}, Text("body of bytes"), report_).ok());
  ASSERT_EQ(report_.files_size(), 1);
  EXPECT_EQ(report_.files(0).name(), "body.ply");
  EXPECT_EQ(report_.files(0).bytes(), 13);
  EXPECT_EQ(report_.files(0).checksum().size(), 16u);
  EXPECT_EQ(report_.meshes(0).faces(), 2);
  WriteBytes(folder_.path() + "/body.ply", "body of bytez");
  EXPECT_EQ(folder_.CheckAll(report_), "body.ply is not as it was written");
  report_.mutable_files(0)->set_bytes(14);
  WriteBytes(folder_.path() + "/body.ply", "body of bytes");
  EXPECT_EQ(folder_.CheckAll(report_), "body.ply is not as it was written");
}

TEST_F(FrameFolderTest, ErrorsOfWritersArePassedOn) {
  const auto fails = [](const std::string&) { return absl::InternalError("the pen broke"); };
  EXPECT_EQ(folder_.Put(FrameFile::kMesh, fails, report_), absl::InternalError("the pen broke"));
  EXPECT_EQ(folder_.PutMesh("body", 3, {}, fails, report_), absl::InternalError("the pen broke"));
  EXPECT_EQ(report_.files_size() + report_.meshes_size(), 0);
  const auto writes_nothing = [](const std::string&) { return absl::OkStatus(); };
  EXPECT_EQ(folder_.Put(FrameFile::kMesh, writes_nothing, report_).code(), absl::StatusCode::kNotFound);
}

TEST_F(FrameFolderTest, AReportOfAnotherFormatIsNone) {
  ASSERT_TRUE(folder_.Commit(report_).ok());
  const std::string path = folder_.PathOf(FrameFile::kReport);
  EXPECT_EQ(folder_.Report()->format_version(), 1);
  WriteBytes(path, "{\"format_version\": 2}");
  EXPECT_EQ(folder_.Report().status(), absl::NotFoundError(folder_.path() + " holds no complete frame"));
  WriteBytes(path, "{\"format_version\": 1}");
  EXPECT_TRUE(folder_.Report().ok());
}

TEST_F(FrameFolderTest, AFrameIsOpenedWhereItIsThere) {
  const std::string out = std::filesystem::canonical(temp_.path()).string() + "/out";
  EXPECT_TRUE(FrameFolder::Open(out, "f", ConfinedFolder::IfMissing::kFail).ok());
  EXPECT_EQ(FrameFolder::Open(out, "g", ConfinedFolder::IfMissing::kFail).status().code(),
            absl::StatusCode::kNotFound);
  EXPECT_EQ(FrameFolder::Open(out + "/none", "f", ConfinedFolder::IfMissing::kFail).status().code(),
            absl::StatusCode::kNotFound);
  EXPECT_FALSE(std::filesystem::exists(out + "/none"));
}

}  // namespace
}  // namespace weft
