#include "services/work/job/import_meshes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "services/formats/files/atomic_file.h"
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

TEST_F(MeshImportTest, ABadFrameLeavesAnEarlierImportAsItWas) {
  ASSERT_TRUE(Import().ok());
  const std::string mesh = *ReadWholeFile(folder_ / "out/2/mesh.ply"),
                    job = *ReadWholeFile(folder_ / "out/job.json");
  WriteBytes(folder_ / "shirt_2.obj", StripObj(0.7));
  WriteBytes(folder_ / "shirt_10.obj", "v nan 0 0\n");
  EXPECT_FALSE(Import().ok());
  EXPECT_EQ(*ReadWholeFile(folder_ / "out/2/mesh.ply"), mesh);
  EXPECT_EQ(*ReadWholeFile(folder_ / "out/job.json"), job);
}

TEST_F(MeshImportTest, RefusesWhatIsTooFarAwayFor32Bits) {
  request_.meshes.resize(1);
  WriteBytes(folder_ / "shirt_10.obj", StripObj(100));  // in m
  EXPECT_TRUE(Import().ok());
  WriteBytes(folder_ / "shirt_10.obj", StripObj(101));
  const absl::Status status = Import().status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(
      std::string(status.message()),
      HasSubstr("shirt_10.obj: vertex 1 is 101 m from the origin, where results of 32 bits are coarse"));
  WriteBytes(folder_ / "shirt_10.obj", StripObj(100));
  WriteBytes(folder_ / "rest.obj", StripObj(101));
  request_.rest = folder_ / "rest.obj";
  EXPECT_THAT(std::string(Import().status().message()),
              HasSubstr("rest.obj: vertex 1 is 101 m from the origin"));
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

TEST_F(MeshImportTest, TellsWhatItMadeAndWhen) {
  std::vector<std::pair<size_t, size_t>> told;
  const auto imported = ImportMeshes(request_, [&](size_t k, size_t all) { told.emplace_back(k, all); }, {});
  ASSERT_TRUE(imported.ok()) << imported.status();
  EXPECT_THAT(told, ElementsAre(std::pair(0, 2), std::pair(1, 2), std::pair(1, 2), std::pair(2, 2)));
  EXPECT_EQ(imported->vertices, 6u);
  EXPECT_EQ(imported->garment, folder_ / "out/garment.ply");
  v1::Job job;
  ASSERT_TRUE(ReadJsonFile(folder_ / "out/job.json", job).ok());
  EXPECT_EQ(job.id(), "import");
  EXPECT_EQ(job.spec().out(), folder_ / "out");
  EXPECT_EQ(job.frames().total(), 2);
  EXPECT_EQ(job.first_frame(), "2");
  EXPECT_EQ(job.last_frame(), "10");
  EXPECT_GT(job.created_unix_ns(), 0);
  EXPECT_EQ(job.started_unix_ns(), job.created_unix_ns());
  EXPECT_GT(job.finished_unix_ns(), job.started_unix_ns());
  EXPECT_FALSE(job.weft_version().empty());
  v1::FrameReport report;
  ASSERT_TRUE(ReadJsonFile(folder_ / "out/2/report.json", report).ok());
  EXPECT_EQ(report.frame(), "2");
  EXPECT_EQ(report.state(), v1::FRAME_STATE_DONE);
  EXPECT_EQ(report.mesh().vertices(), 6);
  EXPECT_EQ(report.weft_version(), job.weft_version());
}

TEST_F(MeshImportTest, NamesWithoutNumbersAreCounted) {
  request_.meshes.clear();
  for (const char* name : {"front", "back"}) {
    WriteBytes(folder_ / absl::StrCat(name, ".obj"), StripObj(1));
    request_.meshes.push_back(folder_ / absl::StrCat(name, ".obj"));
  }
  EXPECT_THAT(Import()->frames, ElementsAre("0000", "0001"));
}

TEST_F(MeshImportTest, TheMeshAtRestMayBeAnother) {
  WriteBytes(folder_ / "rest.obj", StripObj(7));
  request_.rest = folder_ / "rest.obj";
  const auto imported = Import();
  ASSERT_TRUE(imported.ok()) << imported.status();
  EXPECT_NEAR(ReadGarmentMesh(imported->garment)->rest.vertices_mm[0].z(), 7000, 1e-9);
  EXPECT_THAT(imported->frames, ElementsAre("2", "10"));
}

TEST_F(MeshImportTest, AxesOfOtherProgramsAreTurnedToTheWorlds) {
  WriteBytes(folder_ / "rest.obj", StripObj(7));
  request_.rest = folder_ / "rest.obj";
  request_.world_from_mesh = Eigen::Vector3d(1, -1, -1).asDiagonal();
  const auto imported = Import();
  ASSERT_TRUE(imported.ok()) << imported.status();
  EXPECT_TRUE(
      ReadGarmentMesh(imported->garment)->rest.vertices_mm[1].isApprox(Eigen::Vector3d(0, -200, -7000)));
  EXPECT_TRUE(
      ReadMesh(folder_ / "out/10/mesh.ply")->vertices_mm[1].isApprox(Eigen::Vector3d(0, -200, -1000)));
}

TEST_F(MeshImportTest, StopsBetweenFramesWithoutAJobFile) {
  std::stop_source stop;
  std::vector<size_t> told;
  const auto stop_after_a_frame = [&](size_t done, size_t all) {
    EXPECT_EQ(all, 2u);
    told.push_back(done);
    if (told.size() == 3) stop.request_stop();
  };
  const absl::Status status = ImportMeshes(request_, stop_after_a_frame, stop.get_token()).status();
  EXPECT_THAT(told, ElementsAre(0, 1, 1)) << "all are read first, which is half of the work";
  EXPECT_EQ(status.code(), absl::StatusCode::kCancelled);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "out/2/mesh.ply"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out/10"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out/job.json"));
}

TEST_F(MeshImportTest, NeedsAFolderAndAUnit) {
  request_.unit_mm = 0;
  EXPECT_THAT(std::string(Import().status().message()), HasSubstr("unit"));
  request_.unit_mm = 1e-3;
  request_.out.clear();
  EXPECT_EQ(Import().status().code(), absl::StatusCode::kInvalidArgument);
  request_.out = folder_ / "out";
  WriteBytes(folder_ / "out/job.json", "{broken");
  EXPECT_EQ(Import().status().code(), absl::StatusCode::kFailedPrecondition);
}

}  // namespace
}  // namespace weft
