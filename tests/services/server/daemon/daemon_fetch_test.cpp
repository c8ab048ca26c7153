// Where results go, and how clients get them.
#include "services/tools/client/fetch_results.h"
#include "tests/services/server/daemon/daemon_fixture.h"

namespace weft {
namespace {

using ::testing::StartsWith;

TEST_F(DaemonTest, WritesToTheClientsFolderWhenItFindsTheProbe) {
  StartDaemon();
  v1::SubmitJobRequest request = MakeRequest({"a"});
  request.set_out_probe("probe");
  WriteBytes(folder_ / "out/probe", "x");
  const auto job = client_->Submit(request);
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(job->spec().out(), std::filesystem::canonical(folder_ / "out").string());
}

TEST_F(DaemonTest, KeepsResultsItselfWhenTheFolderIsNotShared) {
  StartDaemon();
  v1::SubmitJobRequest request = MakeRequest({"a"});
  request.set_out_probe("probe");
  const std::string own = std::filesystem::canonical(folder_ / "state").string() + "/results/";
  for (const std::string& out : {folder_ / "out", std::string("/home/of/another/machine"), std::string()}) {
    request.mutable_spec()->set_out(out);
    const auto job = client_->Submit(request);
    ASSERT_TRUE(job.ok()) << job.status();
    EXPECT_EQ(job->spec().out(), own + job->id());
    EXPECT_EQ(WaitForEnd(job->id()).state(), v1::JOB_STATE_DONE);
  }
}

TEST_F(DaemonTest, FetchesLargeAndEmptyFilesWhole) {
  StartDaemon();
  const std::string id = Submit({"a"});
  WaitForEnd(id);
  std::string mesh(3 << 20, 'm');
  for (size_t i = 0; i < mesh.size(); ++i) mesh[i] = static_cast<char>(i * 2654435761u >> 24);
  WriteBytes(folder_ / "out/a/mesh.ply", mesh);
  WriteBytes(folder_ / "out/a/cloud.ply", "");
  ASSERT_TRUE(client_->Fetch(id, "a", v1::RESULT_KIND_MESH, folder_ / "mesh.ply").ok());
  EXPECT_EQ(ReadBytes(folder_ / "mesh.ply"), mesh);
  ASSERT_TRUE(client_->Fetch(id, "a", v1::RESULT_KIND_CLOUD, folder_ / "cloud.ply").ok());
  EXPECT_EQ(ReadBytes(folder_ / "cloud.ply"), "");
}

TEST_F(DaemonTest, FetchesNothingThatIsNoResultOfTheJob) {
  StartDaemon();
  const std::string id = Submit({"a"});
  WaitForEnd(id);
  WriteBytes(folder_ / "secret", "x");
  std::filesystem::create_directories(folder_ / "out/a");
  std::filesystem::create_symlink(folder_ / "secret", folder_ / "out/a/mesh.ply");
  const std::string path = folder_ / "fetched";
  EXPECT_EQ(client_->Fetch(id, "a", v1::RESULT_KIND_MESH, path).code(), absl::StatusCode::kPermissionDenied);
  EXPECT_EQ(client_->Fetch(id, "a", v1::RESULT_KIND_CLOUD, path).code(), absl::StatusCode::kNotFound);
  // Folders that a link leads to, wherever it leads.
  std::filesystem::create_directories(folder_ / "elsewhere");
  WriteBytes(folder_ / "elsewhere/cloud.ply", "x");
  WriteBytes(folder_ / "out/other/cloud.ply", "x");
  for (const char* target : {"elsewhere", "out/other"}) {
    std::filesystem::remove_all(folder_ / "out/a");
    std::filesystem::create_directory_symlink(folder_ / target, folder_ / "out/a");
    EXPECT_EQ(client_->Fetch(id, "a", v1::RESULT_KIND_CLOUD, path).code(),
              absl::StatusCode::kPermissionDenied)
        << target;
  }
  EXPECT_EQ(client_->Fetch(id, "b", v1::RESULT_KIND_MESH, path).code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(client_->Fetch(id, "..", v1::RESULT_KIND_MESH, path).code(), absl::StatusCode::kInvalidArgument);
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST_F(DaemonTest, FetchResultsBringsEveryFileThatIsThere) {
  StartDaemon();
  const std::string id = Submit({"a", "bad"});
  const v1::Job job = WaitForEnd(id);
  WriteBytes(folder_ / "out/a/mesh.ply", "mesh");
  WriteBytes(folder_ / "out/a/report.json", "{}");
  WriteBytes(folder_ / "out/bad/report.json", "{\"state\": 5}");
  size_t last = 0;
  ASSERT_TRUE(
      FetchResults(*client_, job, folder_ / "here", [&last](size_t done, size_t) { last = done; }).ok());
  EXPECT_EQ(last, 2u);
  EXPECT_EQ(ReadBytes(folder_ / "here/a/mesh.ply"), "mesh");
  EXPECT_EQ(ReadBytes(folder_ / "here/bad/report.json"), "{\"state\": 5}");
  EXPECT_EQ(ReadBytes(folder_ / "here/job.json"), ReadBytes(folder_ / "out/job.json"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "here/a/cloud.ply"));
}

TEST_F(DaemonTest, FetchResultsFollowsNoLink) {
  StartDaemon();
  const std::string id = Submit({"a"});
  const v1::Job job = WaitForEnd(id);
  WriteBytes(folder_ / "out/a/mesh.ply", "mesh");
  WriteBytes(folder_ / "elsewhere/mesh.ply", "kept");
  std::filesystem::create_directories(folder_ / "here");
  std::filesystem::create_directory_symlink(folder_ / "elsewhere", folder_ / "here/a");
  const absl::Status status = FetchResults(*client_, job, folder_ / "here", {});
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition) << status;
  EXPECT_THAT(std::string(status.message()), ::testing::HasSubstr(folder_ / "here/a"));
  EXPECT_EQ(ReadBytes(folder_ / "elsewhere/mesh.ply"), "kept");
}

}  // namespace
}  // namespace weft
