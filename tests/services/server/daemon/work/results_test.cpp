#include "services/server/daemon/work/results.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

class ResultsTest : public ::testing::Test {
 protected:
  ResultsTest() {
    job_.set_id("j");
    job_.mutable_spec()->set_out(std::filesystem::canonical(folder_.path()).string());
  }
  absl::StatusOr<FilePieces> Open(const std::string& frame, v1::ResultKind kind,
                                  const std::string& mesh = "") const {
    v1::FetchResultRequest request;
    request.set_frame(frame);
    request.set_kind(kind);
    request.set_mesh(mesh);
    return OpenResult(job_, request);
  }

  TempFolder folder_;
  v1::Job job_;
};

TEST_F(ResultsTest, AreFilesOfFramesAndOfTheJob) {
  WriteBytes(folder_ / "a/mesh.ply", "mesh of a");
  WriteBytes(folder_ / "job.json", "{}");
  v1::FileChunk chunk;
  auto mesh = Open("a", v1::RESULT_KIND_MESH);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ASSERT_TRUE(*mesh->Next(&chunk));
  EXPECT_EQ(chunk.data(), "mesh of a");
  EXPECT_FALSE(*mesh->Next(&chunk));
  auto job = Open("", v1::RESULT_KIND_JOB);
  ASSERT_TRUE(job.ok()) << job.status();
  ASSERT_TRUE(*job->Next(&chunk));
  EXPECT_EQ(chunk.data(), "{}");
}

TEST_F(ResultsTest, MeshesAreFoundByTheirNames) {
  const auto of_frame = [&](const std::string& mesh) {
    absl::StatusOr<FilePieces> pieces = Open("a", v1::RESULT_KIND_MESH, mesh);
    v1::FileChunk chunk;
    return pieces.ok() && *pieces->Next(&chunk) ? chunk.data() : std::string(pieces.status().message());
  };
  WriteBytes(folder_ / "a/body.ply", "body of a");
  WriteBytes(folder_ / "a/report.json", R"({"meshes": [{"name": "body", "file": "body.ply"}]})");
  EXPECT_EQ(of_frame("body"), "body of a");
  EXPECT_EQ(of_frame(""), "body of a");  // the only one
  EXPECT_EQ(of_frame("hat"), "job j, frame a: no frame has a mesh \"hat\"; there are body");
  WriteBytes(folder_ / "a/mesh.ply", "garment of a");
  WriteBytes(folder_ / "a/report.json", R"({"meshes": [{"name": "body", "file": "body.ply"},
                                                      {"name": "garment", "file": "mesh.ply"}]})");
  EXPECT_EQ(of_frame(""), "garment of a");
  EXPECT_EQ(of_frame("body"), "body of a");
}

TEST_F(ResultsTest, SayWhatIsMissing) {
  const absl::Status of_frame = Open("a", v1::RESULT_KIND_MESH).status();
  EXPECT_EQ(of_frame.code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(of_frame.message(), "job j, frame a: no mesh.ply; is it finished?");
  EXPECT_EQ(Open("", v1::RESULT_KIND_JOB_REPORT).status().message(),
            "job j: no report.html; is it finished?");
}

TEST_F(ResultsTest, LeadNowhereElse) {
  WriteBytes(folder_ / "secret", "x");
  std::filesystem::create_directories(folder_ / "a");
  std::filesystem::create_symlink(folder_ / "secret", folder_ / "a/mesh.ply");
  EXPECT_EQ(Open("a", v1::RESULT_KIND_MESH).status().code(), absl::StatusCode::kPermissionDenied);
}

}  // namespace
}  // namespace weft
