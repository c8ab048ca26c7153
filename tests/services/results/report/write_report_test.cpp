#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <openssl/evp.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "absl/strings/escaping.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/results/report/html_report.h"
#include "tests/services/results/report/sample_job.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
namespace fs = std::filesystem;

class WriteReport : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    out_ = (fs::path(::testing::TempDir()) / (std::string("weft_report ") + test->name())).string();
    fs::remove_all(out_);
    fs::create_directories(out_);
  }
  void TearDown() override { fs::remove_all(out_); }

  std::string Path(const std::string& name) const { return (fs::path(out_) / name).string(); }

  void WriteFrame(const v1::FrameReport& frame) {
    fs::create_directories(Path(frame.frame()));
    ASSERT_TRUE(WriteJsonFile(Path(frame.frame() + "/report.json"), frame).ok());
    if (frame.has_mesh()) WriteWave(Path(frame.frame() + "/mesh.ply"));
  }

  // A wavy sheet of which the right quarter was not seen.
  static void WriteWave(const std::string& path) {
    constexpr int kSide = 24;
    RegisteredMesh mesh;
    std::vector<Face> faces;
    for (int i = 0; i < kSide; ++i) {
      for (int j = 0; j < kSide; ++j) {
        mesh.vertices_mm.emplace_back(10.0 * j, 10.0 * i, 12 * std::sin(0.5 * j));
        mesh.state.push_back(j < 18 ? VertexState::kObserved : VertexState::kInferred);
        mesh.sigma_mm.push_back(j < 18 ? 0.1f : 4.0f);
        mesh.views.push_back(j < 18 ? 5 : 0);
        if (i + 1 == kSide || j + 1 == kSide) continue;
        const int v = i * kSide + j;
        faces.push_back({v, v + kSide, v + 1});
        faces.push_back({v + 1, v + kSide, v + kSide + 1});
      }
    }
    ASSERT_TRUE(WriteRegisteredMesh(path, mesh, faces).ok());
  }

  std::string Written(const v1::Job& job) {
    const absl::Status status = WriteJobReport(out_, job);
    EXPECT_TRUE(status.ok()) << status;
    const absl::StatusOr<std::string> html = ReadWholeFile(Path("report.html"));
    EXPECT_TRUE(html.ok()) << html.status();
    return html.ok() ? *html : "";
  }

  std::string out_;
};

TEST_F(WriteReport, PicturesSeveralWorstFramesThatAreNotBesideEachOther) {
  std::vector<v1::FrameReport> frames = SampleFrames(40, 2);
  for (const int worst : {10, 11, 12, 25}) frames[worst].mutable_mesh()->set_coverage(0.5 + 0.001 * worst);
  for (const v1::FrameReport& frame : frames) WriteFrame(frame);
  const std::string html = Written(SampleJob(frames));
  EXPECT_THAT(html, HasSubstr("<bdi>000010</bdi> <small>lowest coverage</small>"));
  EXPECT_THAT(html, HasSubstr("<bdi>000025</bdi> <small>low coverage</small>"));
  EXPECT_THAT(html, Not(HasSubstr("<bdi>000011</bdi> <small>")));
  EXPECT_THAT(html, Not(HasSubstr("no images of the cameras")));  // a take that is gone is no fault
}

TEST_F(WriteReport, PicturesFirstWorstAndLastFrame) {
  std::vector<v1::FrameReport> frames = SampleFrames(5, 6);
  frames[3].mutable_mesh()->set_coverage(0.5);
  for (const v1::FrameReport& frame : frames) WriteFrame(frame);
  const std::string html = Written(SampleJob(frames));
  EXPECT_THAT(html, HasSubstr("<bdi>000000</bdi> <small>first frame</small>"));
  EXPECT_THAT(html, HasSubstr("<bdi>000003</bdi> <small>lowest coverage</small>"));
  EXPECT_THAT(html, HasSubstr("<bdi>000004</bdi> <small>last frame</small>"));
  EXPECT_THAT(html, HasSubstr("Back of frame 000003, coloured by uncertainty"));
  EXPECT_THAT(html, HasSubstr("data:image/png;base64,iVBOR"));
  EXPECT_THAT(html, HasSubstr(">0.1 mm and more")) << "the range is that of observed vertices";
  EXPECT_THAT(html, Not(HasSubstr("Warnings")));
}

TEST_F(WriteReport, ShowsEveryMeshInThreeDimensions) {
  std::vector<v1::FrameReport> frames = SampleFrames(4, 2);
  FailFrame("no cell could be triangulated", frames[1]);
  FailFrame("no cell could be triangulated", frames[2]);
  frames[2].mutable_temporal()->set_bridged(true);
  for (const v1::FrameReport& frame : frames) WriteFrame(frame);
  WriteWave(Path("000002/mesh.ply"));
  const std::string html = Written(SampleJob(frames));
  EXPECT_THAT(html, HasSubstr("data-name=\"000000\" data-note=\"\""));
  EXPECT_THAT(html, Not(HasSubstr("data-name=\"000001\"")));
  EXPECT_THAT(html, HasSubstr("data-name=\"000002\" data-note=\"bridged\""));
  EXPECT_THAT(html, HasSubstr("data-name=\"000003\""));
  EXPECT_THAT(html, HasSubstr("data-vertices=\"576\""));
  EXPECT_THAT(html, HasSubstr("<figcaption>Frame 000000, colours: state</figcaption>"));
}

TEST_F(WriteReport, ThePolicyNamesTheOnlyProgramThatMayRun) {
  const std::vector<v1::FrameReport> frames = SampleFrames(2, 2);
  for (const v1::FrameReport& frame : frames) WriteFrame(frame);
  const std::string html = Written(SampleJob(frames));
  const size_t begin = html.find("<script>") + 8, end = html.find("</script>", begin);
  ASSERT_LT(end, html.size());
  std::array<unsigned char, 32> hash{};
  unsigned length = 0;
  EVP_Digest(html.data() + begin, end - begin, hash.data(), &length, EVP_sha256(), nullptr);
  const std::string base64 = absl::Base64Escape(std::string(hash.begin(), hash.end()));
  EXPECT_THAT(html, HasSubstr("script-src 'sha256-" + base64 + "'"));
  EXPECT_EQ(html.find("<script>", end), std::string::npos);
}

TEST_F(WriteReport, FramesComeInTheOrderOfTheirNumbers) {
  std::vector<v1::FrameReport> frames = SampleFrames(3, 2);
  frames[0].set_frame("10");
  frames[1].set_frame("9");
  frames[2].set_frame("009b");
  for (const v1::FrameReport& frame : frames) WriteFrame(frame);
  const std::string html = Written(SampleJob(frames));
  const size_t table = html.find("id=\"frames\"");
  EXPECT_LT(html.find("<bdi>9</bdi>", table), html.find("<bdi>009b</bdi>", table));
  EXPECT_LT(html.find("<bdi>009b</bdi>", table), html.find("<bdi>10</bdi>", table));
}

TEST_F(WriteReport, BrokenFilesAreNotedAndTheRestIsTold) {
  std::vector<v1::FrameReport> frames = SampleFrames(4, 3);
  for (const v1::FrameReport& frame : frames) WriteFrame(frame);
  std::ofstream(Path("000001/report.json")) << "{\"fraem\": 1}";
  std::ofstream(Path("000000/mesh.ply")) << "ply\nformat ascii 1.0\n";
  fs::remove(Path("000003/mesh.ply"));
  fs::create_directories(Path("not a frame"));
  const std::string html = Written(SampleJob(frames));
  EXPECT_THAT(html, HasSubstr("Frame 000001 is missing from this report: "));
  EXPECT_THAT(html, HasSubstr("fraem"));
  EXPECT_THAT(html, HasSubstr("Frame 000000 has no picture: "));
  EXPECT_THAT(html, HasSubstr("Frame 000003 has no picture: "));
  EXPECT_THAT(html, HasSubstr("Frame 000000 is missing in three dimensions: "));
  EXPECT_THAT(html, HasSubstr("data-name=\"000002\""));
  EXPECT_THAT(html, HasSubstr("The job finished 4 frames, the folder holds reports of 3"));
  EXPECT_THAT(html, HasSubstr("good</span> 4 of 4 frames registered"));
}

TEST_F(WriteReport, ResultsOfOtherInputsAreLeftOut) {
  std::vector<v1::FrameReport> frames = SampleFrames(2, 3);
  v1::FrameReport stranger = SampleFrame(7, 3);
  stranger.mutable_inputs()->set_rig("ffffffffffffffff");
  for (const v1::FrameReport& frame : frames) WriteFrame(frame);
  WriteFrame(stranger);
  const std::string html = Written(SampleJob(frames));
  EXPECT_THAT(html, Not(HasSubstr("<bdi>000007</bdi>")));
  EXPECT_THAT(html, HasSubstr("Results of 1 frame in the folder were computed from another rig"));
}

TEST_F(WriteReport, FailedFramesNeedNoMesh) {
  v1::FrameReport frame = SampleFrame(0, 4);
  FailFrame("no cell could be triangulated", frame);
  WriteFrame(frame);
  v1::Job job = SampleJob({frame});
  job.set_state(v1::JOB_STATE_FAILED);
  const std::string html = Written(job);
  EXPECT_THAT(html, HasSubstr("bad</span> The job failed: The frame was not registered.</h1>"));
  EXPECT_THAT(html, Not(HasSubstr("<img")));
}

TEST_F(WriteReport, FolderThatIsNotThereIsAnError) {
  const absl::Status status = WriteJobReport(Path("nowhere"), v1::Job());
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(status.message(), HasSubstr("nowhere"));
}

}  // namespace
}  // namespace weft
