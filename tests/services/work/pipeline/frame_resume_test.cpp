#include "services/work/pipeline/frame_resume.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "absl/strings/str_cat.h"
#include "services/formats/files/cloud_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/work/pipeline/algorithm_versions.h"
#include "services/work/pipeline/frame_folder.h"
#include "services/work/pipeline/stage_keys.h"
#include "tests/alignment/cloth_sheets.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/formats/pcd/with_pcl.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

// One frame whose images are "images"; nobody reads them.
class OneFrame : public FrameSource {
 public:
  const std::vector<std::string>& frame_names() const override { return names_; }
  absl::StatusOr<FrameSet> Read(size_t) const override { return absl::OutOfRangeError("no images"); }
  absl::StatusOr<Frame> ReadView(size_t, size_t) const override { return absl::OutOfRangeError("no images"); }
  absl::StatusOr<std::string> Fingerprint(size_t) const override { return fingerprint_; }
  const std::vector<std::string>& warnings() const override { return warnings_; }

  std::string fingerprint_ = "images";

 private:
  const std::vector<std::string> names_ = {"f0"};
  const std::vector<std::string> warnings_;
};

class FrameResumeTest : public ::testing::Test {
 protected:
  FrameResumeTest() {
    inputs_.garment = testing::SheetTemplate(testing::FlatSheet(4, 4));
    auto dump = std::make_unique<OneFrame>();
    dump_ = dump.get();
    inputs_.dump = std::move(dump);
    Ask([](v1::RegistrationOptions&) {});
  }
  void SetUp() override { Write(); }

  void Ask(const std::function<void(v1::RegistrationOptions&)>& change) {
    v1::RegistrationOptions asked;
    change(asked);
    options_.emplace(MakeJobOptions(asked).value());
  }
  RegisteredMesh Mesh() const {
    const size_t vertices = inputs_.garment.rest.vertices_mm.size();
    return {inputs_.garment.rest.vertices_mm, std::vector<VertexState>(vertices, VertexState::kObserved),
            std::vector<float>(vertices, 0.5f), std::vector<int>(vertices, 3)};
  }
  // A frame as a registration with these options leaves it; the files hold no more than the test needs.
  void Write() {
    const auto folder = FrameFolder::Open(out_, "f0", ConfinedFolder::IfMissing::kMake);
    ASSERT_TRUE(folder.ok()) << folder.status();
    v1::FrameReport report;
    report.set_frame("f0");
    report.set_state(v1::FRAME_STATE_DONE);
    report.set_images_fingerprint("images");
    SignReport(inputs_, options_->message, report);
    report.mutable_temporal()->set_refined(true);
    const auto text = [](const std::string& path) {
      WriteBytes(path, "text");
      return absl::OkStatus();
    };
    const auto mesh = [&](const std::string& path) {
      return WriteRegisteredMesh(path, Mesh(), inputs_.garment.rest.faces);
    };
    ASSERT_TRUE(folder->Put(FrameFile::kCloud, text, report).ok());
    ASSERT_TRUE(folder->Put(FrameFile::kUnrefined, mesh, report).ok());
    ASSERT_TRUE(folder->Put(FrameFile::kMesh, text, report).ok());
    ASSERT_TRUE(folder->Commit(report).ok());
  }
  void ChangeReport(const std::function<void(v1::FrameReport&)>& change) {
    const auto folder = FrameFolder::Open(out_, "f0", ConfinedFolder::IfMissing::kFail);
    v1::FrameReport report = folder->Report().value();
    change(report);
    ASSERT_TRUE(folder->Commit(report).ok());
  }
  std::string File(const char* name) const { return out_ + "/f0/" + name; }
  // "align: why"; "stands" for a whole frame.
  std::string Standing() const {
    const CachedStages standing = InspectFrame(inputs_, 0, *options_, out_);
    return standing.redo ? std::string(StageName(*standing.redo)) + ": " + standing.why : "stands";
  }

  const TempFolder temp_;
  const std::string out_ = std::filesystem::canonical(temp_.path()).string();
  RegistrationInputs inputs_;
  OneFrame* dump_ = nullptr;
  std::optional<JobOptions> options_;
};

TEST_F(FrameResumeTest, AWholeFrameStands) { EXPECT_EQ(Standing(), "stands"); }

TEST_F(FrameResumeTest, NothingStandsWithoutAReportOrOfAFailedFrame) {
  ChangeReport([](v1::FrameReport& report) { report.set_state(v1::FRAME_STATE_FAILED); });
  EXPECT_EQ(Standing(), "decode: ");
  std::filesystem::remove(File("report.json"));
  EXPECT_EQ(Standing(), "decode: ");
  std::filesystem::remove_all(out_ + "/f0");
  EXPECT_EQ(Standing(), "decode: ");
}

TEST_F(FrameResumeTest, BeginsWithTheFirstStageThatDiffers) {
  const char* begins[] = {"decode", "decode", "decode", "align", "refine"};
  for (int stage = kStages - 1; stage >= 0; --stage) {  // each before the one of the last turn
    ChangeReport([stage](v1::FrameReport& report) { report.mutable_keys(stage)->set_version(99); });
    const Stage of = static_cast<Stage>(stage);
    EXPECT_EQ(Standing(), absl::StrCat(begins[stage], ": ", StageName(of), " has version ",
                                       AlgorithmVersion(of), ", was 99"));
  }
}

TEST_F(FrameResumeTest, OfOtherImagesOrAnOldVersionBeginsWithTheImages) {
  ChangeReport([](v1::FrameReport& report) { report.clear_keys(); });
  EXPECT_THAT(Standing(), HasSubstr("decode: it is of version 0.1.2"));
  dump_->fingerprint_ = "others";
  EXPECT_THAT(Standing(), HasSubstr("decode: its images"));
}

TEST_F(FrameResumeTest, BeginsEarlierWhereFilesAreDamaged) {
  ChangeReport([](v1::FrameReport& report) { report.mutable_keys(4)->set_version(9); });
  std::filesystem::remove(File("mesh.ply"));
  EXPECT_EQ(Standing(),
            absl::StrCat("refine: refine has version ", AlgorithmVersion(Stage::kRefine), ", was 9"))
      << "which makes the mesh anyway";
  WriteBytes(File("unrefined.ply"), "damaged");
  EXPECT_EQ(Standing(), "align: unrefined.ply is not as it was written");
  WriteBytes(File("cloud.ply"), "damaged");
  EXPECT_EQ(Standing(), "decode: cloud.ply is not as it was written");
}

TEST_F(FrameResumeTest, MakesTheMeshAgainFromTheUnrefinedOne) {
  std::filesystem::remove(File("mesh.ply"));
  EXPECT_EQ(Standing(), "refine: mesh.ply is missing");
  const CachedStages standing = InspectFrame(inputs_, 0, *options_, out_);
  const auto report = ResumeFrom(standing, inputs_, 0, *options_, out_, {}, {});
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(ReadBytes(File("mesh.ply")), ReadBytes(File("unrefined.ply")));
  EXPECT_FALSE(report->has_temporal()) << "it is to be refined again";
  EXPECT_EQ(Standing(), "stands");
}

TEST_F(FrameResumeTest, ObservationsThatWereNotWrittenNeedTheImages) {
  Ask([](v1::RegistrationOptions& options) { options.set_write_observations(true); });
  EXPECT_EQ(Standing(), "decode: observations.csv was not written");
}

TEST_F(FrameResumeTest, APcdThatWasNotWrittenNeedsTheCloudAlone) {
  ASSERT_TRUE(WriteCloud(File("cloud.ply"), Cloud{}, CloudColumns::kWithCovariance).ok());
  Ask([](v1::RegistrationOptions& options) { options.set_cloud_format("pcd"); });
  EXPECT_EQ(Standing(), "decode: cloud.ply is not as it was written");
  ChangeReport([&](v1::FrameReport& report) {
    const auto folder = FrameFolder::Open(out_, "f0", ConfinedFolder::IfMissing::kFail);
    const auto write = [](const std::string& path) { return WriteCloud(path, Cloud{}); };
    ASSERT_TRUE(folder->Put(FrameFile::kCloud, write, report).ok());
  });
  EXPECT_EQ(Standing(), "refine: cloud.pcd was not written");
  WEFT_SKIP_WITHOUT_PCL();
  ASSERT_TRUE(
      ResumeFrom(InspectFrame(inputs_, 0, *options_, out_), inputs_, 0, *options_, out_, {}, {}).ok());
  EXPECT_EQ(Standing(), "stands");
  WriteBytes(File("cloud.pcd"), "damaged");
  EXPECT_EQ(Standing(), "refine: cloud.pcd is not as it was written");
  Ask([](v1::RegistrationOptions&) {});
  ASSERT_TRUE(
      ResumeFrom(InspectFrame(inputs_, 0, *options_, out_), inputs_, 0, *options_, out_, {}, {}).ok());
  EXPECT_FALSE(std::filesystem::exists(File("cloud.pcd"))) << "damaged, and nobody wants it";
  EXPECT_EQ(Standing(), "stands");
}

TEST_F(FrameResumeTest, FramesThatAreToStandAloneGetTheirOwnMeshAndBack) {
  const std::string own = ReadBytes(File("unrefined.ply"));
  Ask([](v1::RegistrationOptions& options) { options.set_frames_alone(true); });
  EXPECT_EQ(Standing(), "refine: refine is not done any more");
  ASSERT_TRUE(
      ResumeFrom(InspectFrame(inputs_, 0, *options_, out_), inputs_, 0, *options_, out_, {}, {}).ok());
  EXPECT_FALSE(std::filesystem::exists(File("unrefined.ply")));
  EXPECT_EQ(ReadBytes(File("mesh.ply")), own);
  EXPECT_EQ(Standing(), "stands");
  Ask([](v1::RegistrationOptions&) {});
  EXPECT_EQ(Standing(), "refine: refine was not done");
  ASSERT_TRUE(
      ResumeFrom(InspectFrame(inputs_, 0, *options_, out_), inputs_, 0, *options_, out_, {}, {}).ok());
  EXPECT_EQ(ReadBytes(File("unrefined.ply")), own);
  EXPECT_EQ(Standing(), "stands");
}

}  // namespace
}  // namespace weft
