#include "services/work/job/import_meshes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "absl/strings/str_cat.h"
#include "services/formats/files/garment_file.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/mesh_file.h"
#include "tests/capture/temp_folder.h"
#include "weft/v1/job.pb.h"
#include "weft/v1/report.pb.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// A strip of two quads, `lift` units above the ground.
std::string StripObj(double lift) {
  std::string text = "o Strip\n";
  for (int i = 0; i < 6; ++i)
    absl::StrAppend(&text, "v ", 0.2 * (i / 2), " ", 0.2 * (i % 2), " ", lift, "\n");
  for (int i = 0; i < 6; ++i) absl::StrAppend(&text, "vt ", 0.3 * (i / 2), " ", 0.5 * (i % 2), "\n");
  return text + "f 1/1 3/3 4/4 2/2\nf 3/3 5/5 6/6 4/4\n";
}

class MeshImportTest : public ::testing::Test {
 protected:
  MeshImportTest() {
    for (const int frame : {2, 10}) {
      const std::string path = folder_ / absl::StrCat("shirt_", frame, ".obj");
      WriteBytes(path, StripObj(0.1 * frame));
      request_.meshes.push_back(path);
    }
    std::swap(request_.meshes[0], request_.meshes[1]);
    request_.unit_mm = 1000;
    request_.out = folder_ / "out";
  }

  absl::StatusOr<ImportedGarment> Import() { return ImportMeshes(request_, {}, {}); }

  TempFolder folder_;
  MeshImport request_;
};

TEST_F(MeshImportTest, WritesAResultWithAFrameForEachMesh) {
  const auto imported = Import();
  ASSERT_TRUE(imported.ok()) << imported.status();
  EXPECT_THAT(imported->frames, ElementsAre("2", "10"));
  EXPECT_EQ(imported->faces, 4u);
  v1::Job job;
  ASSERT_TRUE(ReadJsonFile(folder_ / "out/job.json", job).ok());
  EXPECT_EQ(job.state(), v1::JOB_STATE_DONE);
  EXPECT_EQ(job.frames().done(), 2);
  const auto garment = ReadGarmentMesh(job.spec().garment());
  ASSERT_TRUE(garment.ok()) << garment.status();
  EXPECT_EQ(job.inputs().garment(), garment->MeshHash());
  EXPECT_FALSE(garment->texture.empty());
  const auto mesh = ReadMesh(folder_ / "out/10/mesh.ply");
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->faces, garment->rest.faces);
  EXPECT_NEAR(mesh->vertices_mm[0].z(), 1000, 1e-9);
  v1::FrameReport report;
  ASSERT_TRUE(ReadJsonFile(folder_ / "out/10/report.json", report).ok());
  EXPECT_EQ(report.inputs().garment(), garment->MeshHash());
  EXPECT_EQ(report.files_size(), 1);
}

TEST_F(MeshImportTest, AnotherImportTakesItsPlace) {
  ASSERT_TRUE(Import().ok());
  request_.meshes.resize(1);
  const auto again = Import();
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_THAT(again->frames, ElementsAre("10"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out/2/mesh.ply"));
}

TEST_F(MeshImportTest, LeavesTheResultOfAJobAlone) {
  WriteBytes(folder_ / "out/job.json", R"({"id": "20260131-104500-1a2b3c4d"})");
  EXPECT_THAT(std::string(Import().status().message()), HasSubstr("holds the result of a job"));
}

TEST_F(MeshImportTest, RefusesWhatIsNoFrameOfTheGarment) {
  WriteBytes(request_.meshes[0], StripObj(1) + "f 1/1 2/2 5/5\n");
  const absl::Status status = Import().status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("shirt_10.obj: has other vertices or faces"));
  request_.meshes = {request_.meshes[1], request_.meshes[1]};
  EXPECT_THAT(std::string(Import().status().message()), HasSubstr("is given twice"));
  request_.meshes = {"shirt.fbx"};
  EXPECT_THAT(std::string(Import().status().message()), HasSubstr("neither .obj nor .ply"));
  request_.meshes.clear();
  EXPECT_EQ(Import().status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace weft
