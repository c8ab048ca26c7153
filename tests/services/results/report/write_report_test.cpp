#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "capture/image/image_file.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/mesh_file.h"
#include "services/formats/files/rig_file.h"
#include "services/results/report/job_page.h"
#include "services/results/report/job_report.h"
#include "tests/services/results/report/sample_job.h"
#include "tests/services/results/report/sample_mesh.h"

namespace weft {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::IsSupersetOf;
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
    if (!frame.has_mesh()) return;
    ASSERT_TRUE(WriteSampleMesh(Path(frame.frame() + "/mesh.ply")).ok());
  }

  v1::JobPage Read(const v1::Job& job) {
    absl::StatusOr<JobReportParts> parts = ReadJobReportParts(out_, job);
    EXPECT_TRUE(parts.ok()) << parts.status();
    return parts.ok() ? JobPageOf(*std::move(parts)) : v1::JobPage();
  }

  std::string out_;
};

// "000010: lowest coverage".
std::vector<std::string> Pictured(const v1::JobPage& page) {
  std::vector<std::string> pictured;
  for (const v1::PageFramePictures& frame : page.pictures())
    pictured.push_back(absl::StrCat(frame.frame(), ": ", frame.why_shown()));
  return pictured;
}

TEST_F(WriteReport, PicturesSeveralWorstFramesThatAreNotBesideEachOther) {
  std::vector<v1::FrameReport> frames = SampleFrames(40, 2);
  for (const int worst : {10, 11, 12, 25}) frames[worst].mutable_mesh()->set_coverage(0.5 + 0.001 * worst);
  for (const v1::FrameReport& frame : frames) WriteFrame(frame);
  const v1::JobPage page = Read(SampleJob(frames));
  EXPECT_THAT(Pictured(page), IsSupersetOf({"000010: lowest coverage", "000025: low coverage"}));
  EXPECT_THAT(Pictured(page), Not(Contains(HasSubstr("000011"))));
  EXPECT_THAT(page.notes(), IsEmpty());  // a take that is gone is no fault
}

TEST_F(WriteReport, PicturesFirstWorstAndLastFrame) {
  std::vector<v1::FrameReport> frames = SampleFrames(5, 6);
  frames[3].mutable_mesh()->set_coverage(0.5);
  for (const v1::FrameReport& frame : frames) WriteFrame(frame);
  const v1::JobPage page = Read(SampleJob(frames));
  ASSERT_THAT(Pictured(page),
              ElementsAre("000000: first frame", "000003: lowest coverage", "000004: last frame"));
  EXPECT_EQ(page.pictures(1).by_sigma(1).title(), "Back");
  EXPECT_THAT(page.pictures(1).by_sigma(1).bytes(), HasSubstr("PNG"));
  // The range is that of observed vertices.
  EXPECT_DOUBLE_EQ(page.pictures(1).sigma_key().scale().high(), 0.1);
  EXPECT_THAT(page.notes(), IsEmpty());
}

TEST_F(WriteReport, ShowsEveryMeshInThreeDimensions) {
  std::vector<v1::FrameReport> frames = SampleFrames(4, 2);
  FailFrame("no cell could be triangulated", frames[1]);
  FailFrame("no cell could be triangulated", frames[2]);
  frames[2].mutable_temporal()->set_bridged(true);
  for (const v1::FrameReport& frame : frames) WriteFrame(frame);
  ASSERT_TRUE(WriteSampleMesh(Path("000002/mesh.ply")).ok());
  const v1::JobPage page = Read(SampleJob(frames));
  const v1::PageSequence& sequence = page.sequence();
  ASSERT_EQ(sequence.frames_size(), 3);
  EXPECT_EQ(sequence.frames(0).name() + sequence.frames(0).note(), "000000");
  EXPECT_EQ(sequence.frames(1).name() + sequence.frames(1).note(), "000002bridged");
  EXPECT_EQ(sequence.frames(2).name(), "000003");
  EXPECT_EQ(sequence.vertices(), 576);
  EXPECT_EQ(sequence.still().title(), "Frame 000000, colours: state");
}

TEST_F(WriteReport, ImportsAreShownInThreeDimensionsWithoutPicturesOfStates) {
  v1::FrameReport frame = SampleFrame(0, 2);
  WriteFrame(frame);
  const absl::StatusOr<TriangleMesh> mesh = ReadMesh(Path("000000/mesh.ply"));
  ASSERT_TRUE(mesh.ok() && WriteMesh(Path("000000/mesh.ply"), *mesh).ok());
  const v1::JobPage page = Read(SampleJob({frame}));
  EXPECT_THAT(page.notes(), IsEmpty());
  EXPECT_THAT(Pictured(page), IsEmpty());
  EXPECT_EQ(page.sequence().frames_size(), 1);
}

TEST_F(WriteReport, GarmentsOfAJointTemplateArePartsOfTheSequence) {
  v1::FrameReport frame = SampleFrame(0, 2);
  for (const auto& [id, vertices] : {std::pair("skirt", 240), {"shirt", 336}}) {
    v1::GarmentReport& garment = *frame.mutable_mesh()->add_garments();
    garment.set_id(id);
    garment.set_vertices(vertices);
  }
  WriteFrame(frame);
  const v1::PageSequence sequence = Read(SampleJob({frame})).sequence();
  ASSERT_EQ(sequence.parts_size(), 2);
  EXPECT_EQ(sequence.parts(0).name(), "skirt");
  EXPECT_GT(sequence.parts(0).faces(), 400);
  EXPECT_EQ(sequence.parts(0).faces() + sequence.parts(1).faces(), 23 * 23 * 2);
  EXPECT_EQ(sequence.faces().size(), 6u * 23 * 23 * 2);
}

TEST_F(WriteReport, IsThePageOfTheFolder) {
  const std::vector<v1::FrameReport> frames = SampleFrames(2, 2);
  for (const v1::FrameReport& frame : frames) WriteFrame(frame);
  const v1::Job job = SampleJob(frames);
  ASSERT_TRUE(WriteJobReport(out_, job).ok());
  EXPECT_EQ(ReadWholeFile(Path("report.html")).value(), MakeJobReport(ReadJobReportParts(out_, job).value()));
}

TEST_F(WriteReport, FramesComeInTheOrderOfTheirNumbers) {
  std::vector<v1::FrameReport> frames = SampleFrames(3, 2);
  frames[0].set_frame("10");
  frames[1].set_frame("9");
  frames[2].set_frame("009b");
  for (const v1::FrameReport& frame : frames) WriteFrame(frame);
  std::vector<std::string> names;
  const v1::JobPage page = Read(SampleJob(frames));
  for (const v1::FrameReport& frame : page.frames()) names.push_back(frame.frame());
  EXPECT_THAT(names, ElementsAre("9", "009b", "10"));
}

TEST_F(WriteReport, BrokenFilesAreNotedAndTheRestIsTold) {
  std::vector<v1::FrameReport> frames = SampleFrames(4, 3);
  for (const v1::FrameReport& frame : frames) WriteFrame(frame);
  std::ofstream(Path("000001/report.json")) << "{\"fraem\": 1}";
  std::ofstream(Path("000000/mesh.ply")) << "ply\nformat ascii 1.0\n";
  fs::remove(Path("000003/mesh.ply"));
  fs::create_directories(Path("not a frame"));
  const v1::JobPage page = Read(SampleJob(frames));
  for (const char* note :
       {"Frame 000001 is missing from this report: ", "fraem", "Frame 000000 has no picture: ",
        "Frame 000003 has no picture: ", "Frame 000000 is missing in three dimensions: ",
        "The job finished 4 frames, the folder holds reports of 3"})
    EXPECT_THAT(page.notes(), Contains(HasSubstr(note)));
  ASSERT_EQ(page.sequence().frames_size(), 1);
  EXPECT_EQ(page.sequence().frames(0).name(), "000002");
  EXPECT_THAT(page.headline(), HasSubstr("4 of 4 frames registered"));
  EXPECT_EQ(page.job().verdict().grade(), v1::GRADE_GOOD);
}

TEST_F(WriteReport, ResultsOfOtherInputsAreLeftOut) {
  std::vector<v1::FrameReport> frames = SampleFrames(2, 3);
  v1::FrameReport stranger = SampleFrame(7, 3);
  stranger.mutable_inputs()->set_rig("ffffffffffffffff");
  for (const v1::FrameReport& frame : frames) WriteFrame(frame);
  WriteFrame(stranger);
  const v1::JobPage page = Read(SampleJob(frames));
  EXPECT_EQ(page.frames_size(), 2);
  EXPECT_THAT(page.notes(),
              Contains(HasSubstr("Results of 1 frame in the folder were computed from another rig")));
}

TEST_F(WriteReport, FailedFramesNeedNoMesh) {
  v1::FrameReport frame = SampleFrame(0, 4);
  FailFrame("no cell could be triangulated", frame);
  WriteFrame(frame);
  v1::Job job = SampleJob({frame});
  job.set_state(v1::JOB_STATE_FAILED);
  const v1::JobPage page = Read(job);
  EXPECT_EQ(page.headline(), "The job failed: The frame was not registered.");
  EXPECT_EQ(page.job().verdict().grade(), v1::GRADE_BAD);
  EXPECT_THAT(page.pictures(), IsEmpty());
  EXPECT_FALSE(page.has_sequence());
}

TEST_F(WriteReport, FolderThatIsNotThereIsAnError) {
  const absl::Status status = WriteJobReport(Path("nowhere"), v1::Job());
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(status.message(), HasSubstr("nowhere"));
}

// Two cameras before the sample mesh; frames that failed, too, have images.
class WriteReportWithImages : public WriteReport {
 protected:
  void SetUp() override {
    WriteReport::SetUp();
    for (const char* id : {"400000", "400007"}) {
      CameraModel& camera = rig_.cameras.emplace_back();
      camera.id = id, camera.width_px = camera.height_px = 64;
      camera.fx_px = camera.fy_px = 200, camera.cx_px = camera.cy_px = 32;
      camera.translation_mm = {-115, -115, 1000};
    }
    ASSERT_TRUE(WriteRig(Path("rig.json"), rig_).ok());
  }

  void Record(const v1::FrameReport& frame) {
    Frame grey;
    grey.width_px = grey.height_px = 64;
    grey.pixels = std::make_shared<std::vector<uint8_t>>(64 * 64, uint8_t{90});
    fs::create_directories(Path("take/" + frame.frame()));
    for (const CameraModel& camera : rig_.cameras)
      ASSERT_TRUE(WriteImageFile(Path("take/" + frame.frame() + "/" + camera.id + ".png"), grey).ok());
  }

  v1::Job JobOf(std::vector<v1::FrameReport>& frames) {
    for (v1::FrameReport& frame : frames) {
      frame.clear_inputs();
      WriteFrame(frame);
      Record(frame);
    }
    v1::Job job = SampleJob(frames);
    job.mutable_spec()->set_dump(Path("take"));
    job.mutable_spec()->set_rig(Path("rig.json"));
    job.mutable_inputs()->set_rig(rig_.ContentHash());
    return job;
  }

  static std::string TitlesOf(const v1::PageFramePictures& frame) {
    std::string titles;
    for (const v1::PagePicture& picture : frame.in_images()) titles += picture.title() + ", ";
    return titles;
  }

  Rig rig_;
};

TEST_F(WriteReportWithImages, ImagesShowTheMeshAndUpToThreeFailedFrames) {
  std::vector<v1::FrameReport> frames = SampleFrames(6, 2);
  for (int f = 1; f < 6; ++f) FailFrame(f == 1 ? "too dark" : "", frames[f]);
  frames[2].mutable_temporal()->set_bridged(true);
  const v1::Job job = JobOf(frames);
  ASSERT_TRUE(WriteSampleMesh(Path("000002/mesh.ply")).ok());
  const v1::JobPage page = Read(job);
  EXPECT_THAT(page.notes(), IsEmpty());
  EXPECT_THAT(Pictured(page), ElementsAre("000000: ", "000001: failed: too dark",
                                          "000002: failed and bridged", "000004: failed"));
  EXPECT_EQ(TitlesOf(page.pictures(0)), "Camera 400007, ");
  for (int picture = 1; picture < 4; ++picture)
    EXPECT_EQ(TitlesOf(page.pictures(picture)), "400007, 400000, ") << picture;
}

TEST_F(WriteReportWithImages, AnotherRigIsNotedAndAGoneOneIsNot) {
  std::vector<v1::FrameReport> frames = SampleFrames(2, 2);
  FailFrame("too dark", frames[1]);
  v1::Job job = JobOf(frames);
  job.mutable_inputs()->set_rig("ab");
  const v1::JobPage page = Read(job);
  EXPECT_THAT(page.notes(),
              ElementsAre("The report has no images of the cameras: " + Path("rig.json") + ": has hash " +
                          rig_.ContentHash() + ", the job was computed with ab"));
  EXPECT_EQ(page.pictures_size(), 1);
  fs::remove(Path("rig.json"));
  EXPECT_THAT(Read(job).notes(), IsEmpty());
}

TEST_F(WriteReport, FramesOfOtherJobsAreNoted) {
  const std::vector<v1::FrameReport> frames = SampleFrames(3, 2);
  for (const v1::FrameReport& frame : frames) WriteFrame(frame);
  v1::Job job = SampleJob({frames[0]});
  job.mutable_frames()->set_failed(1);
  EXPECT_THAT(
      Read(job).notes(),
      ElementsAre("The folder holds results of 3 frames, the job finished 2; those of earlier jobs on the "
                  "same inputs are shown too."));
  job.mutable_frames()->set_degraded(2);
  EXPECT_THAT(
      Read(job).notes(),
      ElementsAre("The job finished 4 frames, the folder holds reports of 3; the others are missing from "
                  "plots and tables."));
  job.mutable_frames()->set_degraded(1);
  EXPECT_THAT(Read(job).notes(), IsEmpty());
  job.mutable_frames()->Clear();
  EXPECT_THAT(Read(job).notes(), IsEmpty()) << "nothing tells how many";
}

TEST_F(WriteReport, DrivenFramesArePicturedByTheirSigma) {
  std::vector<v1::FrameReport> frames = SampleFrames(9, 2);
  for (int f = 0; f < 9; ++f) {
    frames[f].mutable_driven()->set_median_sigma_mm(f == 4 ? 9 : f == 6 ? 8 : 1);
    WriteFrame(frames[f]);
  }
  EXPECT_THAT(Pictured(Read(SampleJob(frames))), ElementsAre("000000: first frame", "000004: largest sigma",
                                                             "000006: large sigma", "000008: last frame"));
}

TEST_F(WriteReport, WorstFramesAreApartByATwentiethOfTheTake) {
  std::vector<v1::FrameReport> frames = SampleFrames(20, 2);
  for (const auto& [frame, coverage] : {std::pair{5, 0.1}, {6, 0.2}, {7, 0.3}, {19, 0.15}})
    frames[frame].mutable_mesh()->set_coverage(coverage);
  for (const v1::FrameReport& frame : frames) WriteFrame(frame);
  EXPECT_THAT(Pictured(Read(SampleJob(frames))),
              ElementsAre("000000: first frame", "000005: lowest coverage", "000007: low coverage",
                          "000019: last frame, low coverage"));
}

TEST_F(WriteReport, OthersAskForPicturesOfTheirFrames) {
  const std::vector<v1::FrameReport> frames = SampleFrames(4, 2);
  for (const v1::FrameReport& frame : frames) WriteFrame(frame);
  ReportExtras extras;
  extras.frames = {{"000002", "largest error"}, {"000003", "large error"}, {"000009", "not there"}};
  const auto parts = ReadJobReportParts(out_, SampleJob(frames), extras);
  ASSERT_TRUE(parts.ok()) << parts.status();
  std::string shown;
  for (const FramePictures& frame : parts->pictures) shown += frame.frame + ": " + frame.why_shown + "\n";
  EXPECT_THAT(shown, HasSubstr("000002: largest error\n"));
  EXPECT_THAT(shown, HasSubstr("000003: last frame, large error\n"));
}

}  // namespace
}  // namespace weft
