#include "services/tools/client/fetch_results.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>

#include "services/server/rpc/result_names.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/client/answering_daemon.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

class FetchResultsTest : public ::testing::Test {
 protected:
  FetchResultsTest() {
    job_.set_id("j1");
    daemon_.jobs.frames = [this](const v1::ListFramesRequest&, v1::ListFramesResponse* out) {
      for (const auto& [name, state] : frames_) {
        out->add_frames()->set_frame(name);
        out->mutable_frames()->rbegin()->set_state(state);
      }
      return grpc::Status::OK;
    };
    daemon_.jobs.fetch = [this](const v1::FetchResultRequest& request,
                                grpc::ServerWriter<v1::FileChunk>* out) {
      const std::string text = request.frame() + " " + v1::ResultKind_Name(request.kind());
      asked_.push_back(text);
      if (request.kind() == v1::RESULT_KIND_CLOUD)
        return grpc::Status(grpc::StatusCode::NOT_FOUND, "no cloud");
      const std::string bytes = content_.contains(text) ? content_.at(text) : text;
      out->Write(Chunk(bytes, 0, static_cast<int64_t>(bytes.size()), "v1"));
      return grpc::Status::OK;
    };
  }
  absl::Status Fetch(std::stop_token stop = {}) {
    return FetchResults(
        daemon_.client(), job_, folder_ / "out",
        [this](size_t done, size_t total) { progress_.emplace_back(done, total); }, std::move(stop));
  }
  std::vector<std::string> Files(const std::string& folder) const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder)) names.push_back(entry.path().filename());
    return names;
  }

  AnsweringDaemon daemon_;
  const TempFolder folder_;
  v1::Job job_;
  std::map<std::string, v1::FrameState> frames_;
  std::map<std::string, std::string> content_;  // other than what was asked for
  std::vector<std::string> asked_;
  std::vector<std::pair<size_t, size_t>> progress_;
};

TEST_F(FetchResultsTest, WritesFilesOfFramesThatHaveSome) {
  frames_ = {{"0001", v1::FRAME_STATE_DONE},
             {"0002", v1::FRAME_STATE_DEGRADED},
             {"0003", v1::FRAME_STATE_FAILED},
             {"0004", v1::FRAME_STATE_RUNNING},
             {"0005", v1::FRAME_STATE_CANCELLED}};
  ASSERT_TRUE(Fetch().ok());
  EXPECT_THAT(Files(folder_ / "out"),
              UnorderedElementsAre("0001", "0002", "0003", ResultFileName(v1::RESULT_KIND_JOB_REPORT),
                                   ResultFileName(v1::RESULT_KIND_JOB)));
  EXPECT_THAT(
      Files(folder_ / "out/0002"),
      UnorderedElementsAre(ResultFileName(v1::RESULT_KIND_OBSERVATIONS), ResultFileName(v1::RESULT_KIND_MESH),
                           ResultFileName(v1::RESULT_KIND_FRAME_REPORT)));
  EXPECT_EQ(ReadBytes(folder_ / "out/0003/mesh.ply"), "0003 RESULT_KIND_MESH");
  EXPECT_EQ(ReadBytes(folder_ / "out/job.json"), " RESULT_KIND_JOB");
  EXPECT_EQ(progress_.size(), 5u);
  EXPECT_EQ(progress_.front(), std::pair(size_t{1}, size_t{5}));
  EXPECT_EQ(progress_.back(), std::pair(size_t{5}, size_t{5}));
}

TEST_F(FetchResultsTest, ReportsComeLastAndPointCloudsWhereTheyWereAskedFor) {
  frames_ = {{"0001", v1::FRAME_STATE_DONE}};
  ASSERT_TRUE(Fetch().ok());
  EXPECT_THAT(asked_,
              ElementsAre("0001 RESULT_KIND_OBSERVATIONS", "0001 RESULT_KIND_CLOUD", "0001 RESULT_KIND_MESH",
                          "0001 RESULT_KIND_FRAME_REPORT", " RESULT_KIND_JOB_REPORT", " RESULT_KIND_JOB"));
  asked_.clear();
  job_.mutable_spec()->mutable_options()->set_cloud_format("pcd");
  ASSERT_TRUE(Fetch().ok());
  EXPECT_EQ(asked_[2], "0001 RESULT_KIND_CLOUD_PCD");
  EXPECT_EQ(asked_.size(), 7u);
}

TEST_F(FetchResultsTest, WritesNothingOutsideOfTheFolder) {
  for (const char* name : {"", ".", "..", "../x", "a/b"}) {
    frames_ = {{name, v1::FRAME_STATE_DONE}};
    EXPECT_EQ(Fetch(), absl::InvalidArgumentError(std::string("the daemon names a frame \"") + name +
                                                  "\", which is no name"));
  }
  EXPECT_THAT(asked_, IsEmpty());
  EXPECT_THAT(Files(folder_ / "out"), IsEmpty());
  frames_ = {{"..x", v1::FRAME_STATE_DONE}};
  EXPECT_TRUE(Fetch().ok());
  fs::create_directories(folder_ / "elsewhere");
  fs::create_directory_symlink(folder_ / "elsewhere", folder_ / "out/0001");
  frames_ = {{"0001", v1::FRAME_STATE_DONE}};
  EXPECT_TRUE(absl::IsFailedPrecondition(Fetch()));
  EXPECT_THAT(Files(folder_ / "elsewhere"), IsEmpty());
}

TEST_F(FetchResultsTest, EndsWhereItIsStoppedOrTheDaemonRefuses) {
  frames_ = {{"0001", v1::FRAME_STATE_DONE}};
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(Fetch(stop.get_token()), absl::CancelledError("stopped while the results were fetched"));
  EXPECT_THAT(asked_, IsEmpty());
  daemon_.jobs.fetch = [](const v1::FetchResultRequest&, grpc::ServerWriter<v1::FileChunk>*) {
    return grpc::Status(grpc::StatusCode::PERMISSION_DENIED, "not yours");
  };
  EXPECT_TRUE(absl::IsPermissionDenied(Fetch()));
  EXPECT_THAT(progress_, IsEmpty());
  daemon_.jobs.frames = nullptr;
  EXPECT_FALSE(Fetch().ok());
}

// The report is untrusted: what it names beside the garment is fetched, what is no name is refused.
TEST_F(FetchResultsTest, OtherMeshesAreThoseOfTheReport) {
  frames_ = {{"0001", v1::FRAME_STATE_DONE}};
  std::string report = R"({"frame": "0001", "meshes": [{"name": "garment", "file": "mesh.ply"},
                          {"name": "body", "file": "body.ply"}, {"name": "shoe", "file": "shoe.ply"}]})";
  daemon_.jobs.fetch = [&](const v1::FetchResultRequest& request, grpc::ServerWriter<v1::FileChunk>* out) {
    asked_.push_back(v1::ResultKind_Name(request.kind()) + " " + request.mesh());
    if (request.mesh() == "shoe") return grpc::Status(grpc::StatusCode::NOT_FOUND, "none");
    const std::string text = request.kind() == v1::RESULT_KIND_FRAME_REPORT ? report : "of " + request.mesh();
    out->Write(Chunk(text, 0, static_cast<int64_t>(text.size()), "v1"));
    return grpc::Status::OK;
  };
  ASSERT_TRUE(Fetch().ok());
  EXPECT_EQ(ReadBytes(folder_ / "out/0001/mesh.ply"), "of garment");
  EXPECT_EQ(ReadBytes(folder_ / "out/0001/body.ply"), "of body");
  EXPECT_FALSE(fs::exists(folder_ / "out/0001/shoe.ply"));
  EXPECT_THAT(asked_,
              ElementsAre("RESULT_KIND_OBSERVATIONS ", "RESULT_KIND_CLOUD ", "RESULT_KIND_MESH garment",
                          "RESULT_KIND_FRAME_REPORT ", "RESULT_KIND_MESH body", "RESULT_KIND_MESH shoe",
                          "RESULT_KIND_JOB_REPORT ", "RESULT_KIND_JOB "));
  report = R"({"frame": "0001", "meshes": [{"name": "../body", "file": "../body.ply"}]})";
  EXPECT_TRUE(absl::IsInvalidArgument(Fetch()));
  EXPECT_FALSE(fs::exists(folder_ / "out/body.ply"));
}

// XXH3-64 of no bytes is 2d06800538d394c2, as the reference implementation's `xxhsum -H3` prints it.
TEST_F(FetchResultsTest, RefusesAFileThatIsNotAsItsReportListsIt) {
  frames_ = {{"0001", v1::FRAME_STATE_DONE}};
  std::string& report = content_["0001 RESULT_KIND_FRAME_REPORT"];
  std::string& mesh = content_["0001 RESULT_KIND_MESH"];
  report = R"({"files": [{"name": "mesh.ply", "bytes": "0", "checksum": "2d06800538d394c2"}]})";
  EXPECT_TRUE(Fetch().ok());
  mesh = "x";
  const absl::Status damaged = Fetch();
  EXPECT_EQ(damaged.code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(damaged.message(), folder_ / "out/0001/mesh.ply" +
                                   ": is not as report.json lists it; `weft register` with the same inputs "
                                   "computes the frame again");
  mesh.clear();
  report = R"({"files": [{"name": "mesh.ply", "bytes": "0", "checksum": "2d06800538d394c3"}]})";
  EXPECT_EQ(Fetch().code(), absl::StatusCode::kDataLoss);
  report = R"({"files": [{"name": "cloud.ply", "bytes": "1", "checksum": "0"}]})";
  EXPECT_TRUE(Fetch().ok()) << "it was not there to fetch";
  report = R"({"files": [{"name": "../../j1", "bytes": "1", "checksum": "0"}]})";
  EXPECT_FALSE(Fetch().ok()) << "names are no paths";
}

}  // namespace
}  // namespace weft
