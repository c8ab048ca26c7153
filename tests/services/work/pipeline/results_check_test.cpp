#include "services/work/pipeline/results_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "services/formats/files/json_file.h"
#include "services/formats/files/rig_file.h"
#include "services/work/pipeline/frame_files.h"
#include "services/work/pipeline/frame_folder.h"
#include "services/work/pipeline/frame_inputs.h"
#include "services/work/pipeline/frame_neighbors.h"
#include "services/work/pipeline/output_folder.h"
#include "services/work/pipeline/stage_keys.h"
#include "simulation/studio_rig.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr int kFrames = 5;

// A job of five frames whose results are whole; frame 3 failed, and its mesh comes from its neighbours.
class ResultsCheckTest : public ::testing::Test {
 protected:
  ResultsCheckTest() {
    job_.mutable_spec()->set_out(folder_.path());
    job_.mutable_spec()->set_rig(inputs_ / "rig.json");
    job_.mutable_spec()->set_dump(inputs_ / "take");
    job_.mutable_spec()->mutable_options()->set_scans(inputs_ / "scans");
    EXPECT_TRUE(WriteRig(job_.spec().rig(), *MakeStudioRig("ring", {.cameras = 2})).ok());
    for (int i = 0; i < kFrames; ++i) WriteBytes(Image(i), "pixels");
    const auto fingerprints = FingerprintsNow::Open(job_.spec());
    EXPECT_TRUE(fingerprints.ok()) << fingerprints.status();
    for (int i = 0; i < kFrames; ++i) fingerprint_[i] = fingerprints->Of(Name(i));
    job_.mutable_inputs()->set_rig("1111111111111111");
    for (int i = 0; i < kFrames; ++i) {
      infos_.emplace_back();
      infos_[i].set_frame(Name(i));
      infos_[i].set_state(i == 3 ? v1::FRAME_STATE_FAILED : v1::FRAME_STATE_DONE);
      Write(i);
    }
  }

  static std::string Name(int frame) { return "f" + std::to_string(frame); }
  std::string File(int frame, const std::string& name) const { return folder_ / (Name(frame) + "/" + name); }
  void Write(int frame) {
    v1::FrameReport report;
    report.set_frame(Name(frame));
    report.set_state(infos_[frame].state());
    report.set_images_fingerprint(fingerprint_[frame]);
    *report.mutable_inputs() = job_.inputs();
    *report.mutable_keys() = KeysOf(job_.inputs(), job_.spec().options());
    report.mutable_temporal()->set_window(WindowOf(frame));
    const auto folder = FrameFolder::Open(folder_.path(), Name(frame), ConfinedFolder::IfMissing::kMake);
    ASSERT_TRUE(folder.ok()) << folder.status();
    for (const FrameFile file : {FrameFile::kMesh, FrameFile::kUnrefined, FrameFile::kCloud}) {
      const auto write = [file](const std::string& path) {
        WriteBytes(path, FileName(file));
        return absl::OkStatus();
      };
      ASSERT_TRUE(folder->Put(file, write, report).ok());
    }
    ASSERT_TRUE(folder->Commit(report).ok());
  }
  void Change(int frame, const std::function<void(v1::FrameReport&)>& change) {
    v1::FrameReport report;
    ASSERT_TRUE(ReadJsonFile(File(frame, "report.json"), report).ok());
    change(report);
    ASSERT_TRUE(WriteJsonFile(File(frame, "report.json"), report).ok());
  }
  std::vector<std::string> Incomplete() {
    const auto found = FindIncompleteFrames(job_, infos_);
    EXPECT_TRUE(found.ok()) << found.status();
    std::vector<std::string> lines;
    for (const IncompleteFrame& frame : *found) {
      lines.push_back(infos_[frame.position].frame() + ": " + frame.why);
    }
    return lines;
  }

  std::string Image(int frame) const { return inputs_ / ("take/" + Name(frame) + "/c00.png"); }
  // The frames before and after each: of a failed one all up to the nearest registered ones.
  std::string WindowOf(int frame) const {
    std::string window = fingerprint_[frame];
    for (const int other : {frame - 1, frame + 1}) {
      if (other >= 0 && other < kFrames) window += " " + Name(other) + ":" + fingerprint_[other];
    }
    return window;
  }

  const TempFolder folder_, inputs_;
  std::string fingerprint_[kFrames];
  v1::Job job_;
  std::vector<v1::FrameInfo> infos_;
};

TEST_F(ResultsCheckTest, WholeResultsAreComplete) { EXPECT_THAT(Incomplete(), IsEmpty()); }

TEST_F(ResultsCheckTest, FindsFilesThatAreMissingDamagedOrNotOfThisRun) {
  fs::remove(File(0, "mesh.ply"));
  WriteBytes(File(1, "cloud.ply"), "cloud.plz");
  WriteBytes(File(2, "observations.csv"), "of an earlier run");
  fs::remove(File(3, "mesh.ply"));
  WriteBytes(File(4, "report.json"), ReadBytes(File(4, "report.json")).substr(0, 40));
  EXPECT_THAT(Incomplete(), ElementsAre("f0: mesh.ply is missing", "f1: cloud.ply is not as it was written",
                                        "f2: observations.csv is not of this run", "f3: mesh.ply is missing",
                                        HasSubstr("f4: report.json is missing, damaged")));
}

TEST_F(ResultsCheckTest, FindsFramesOfOtherOptionsInputsVersionsAndFormats) {
  Change(0, [](v1::FrameReport& report) { report.mutable_keys(4)->set_options("0"); });
  Change(1, [](v1::FrameReport& report) { report.mutable_keys(1)->set_inputs("2222222222222222"); });
  Change(2, [](v1::FrameReport& report) { report.mutable_keys(3)->set_version(1000); });
  Change(3, [](v1::FrameReport& report) { report.set_format_version(0); });
  Change(4, [](v1::FrameReport& report) { report.set_state(v1::FRAME_STATE_FAILED); });
  EXPECT_EQ(Incomplete().size(), 5u);
}

TEST_F(ResultsCheckTest, FindsFramesWhoseImagesOrScanChanged) {
  WriteBytes(Image(1), "other pixels");
  fs::last_write_time(Image(2), fs::last_write_time(Image(2)) + std::chrono::nanoseconds(1));
  fs::remove(Image(3));
  WriteBytes(inputs_ / "take/f3/c01.png", "pixels");
  WriteBytes(inputs_ / "scans/f4.ply", "a scan");
  const std::string why = "its images, scan or start changed since they were read";
  EXPECT_THAT(Incomplete(), ElementsAre("f1: " + why, "f2: " + why, "f3: " + why, "f4: " + why));
}

TEST_F(ResultsCheckTest, FindsFramesWhoseImagesAreGone) {
  fs::remove_all(inputs_ / "take/f2");
  EXPECT_THAT(Incomplete(), ElementsAre(HasSubstr("f2: its images")));
  fs::remove_all(inputs_ / "take");
  const auto found = FindIncompleteFrames(job_, infos_);
  EXPECT_EQ(found.status().code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(found.status().message(), HasSubstr(inputs_ / "take"));
}

TEST_F(ResultsCheckTest, FindsRegisteredFramesThatAreNotRefined) {
  Change(1, [](v1::FrameReport& report) { report.clear_temporal(); });
  EXPECT_THAT(Incomplete(), ElementsAre(HasSubstr("f1: its neighbours' refinement is missing")));
}

TEST_F(ResultsCheckTest, ANeighbourBringsTheRefinementOfAFailedFrame) {
  Change(3, [](v1::FrameReport& report) { report.clear_temporal(); });
  EXPECT_THAT(Incomplete(), ElementsAre(HasSubstr("f2: its neighbours' refinement is missing")));
}

TEST_F(ResultsCheckTest, FramesThatWaitAreNobodysConcern) {
  infos_[2].set_state(v1::FRAME_STATE_WAITING);
  fs::remove_all(folder_ / Name(2));
  Change(1, [](v1::FrameReport& report) { report.clear_temporal(); });
  EXPECT_THAT(Incomplete(), IsEmpty());
}

TEST_F(ResultsCheckTest, ARemovedFolderLacksEverything) {
  fs::remove_all(folder_.path());
  EXPECT_EQ(Incomplete().size(), 5u);
  fs::create_directory(folder_.path());
}

TEST_F(ResultsCheckTest, LinksAreNoResults) {
  fs::rename(folder_ / "f0", folder_ / "moved");
  fs::create_directory_symlink(folder_ / "moved", folder_ / "f0");
  fs::rename(File(1, "mesh.ply"), File(1, "moved"));
  fs::create_symlink(File(1, "moved"), File(1, "mesh.ply"));
  EXPECT_THAT(Incomplete(), ElementsAre(HasSubstr("remove the link"), "f1: mesh.ply is missing"));
}

TEST_F(ResultsCheckTest, RemovesTemporaryFilesAndNothingElse) {
  WriteBytes(File(0, "mesh.ply.tmp.12.3"), "half");
  WriteBytes(File(0, "mine.tmp.12.3"), "kept");
  WriteBytes(folder_ / "job.json.tmp.1.0", "half");
  WriteBytes(folder_ / "other/mesh.ply.tmp.12.3", "of no frame");
  RemoveTemporaryFiles(folder_.path(), {Name(0), Name(1), "none"});
  EXPECT_FALSE(fs::exists(File(0, "mesh.ply.tmp.12.3")));
  EXPECT_FALSE(fs::exists(folder_ / "job.json.tmp.1.0"));
  EXPECT_TRUE(fs::exists(File(0, "mine.tmp.12.3")));
  EXPECT_TRUE(fs::exists(folder_ / "other/mesh.ply.tmp.12.3"));
  EXPECT_THAT(Incomplete(), IsEmpty());
}

TEST_F(ResultsCheckTest, OutMayNotLieInWhatIsRead) {
  v1::RegistrationSpec spec;
  fs::create_directories(folder_ / "take/0000");
  spec.set_dump(folder_ / "take");
  spec.set_garment(folder_ / "shirt");
  for (const char* out : {"take", "take/result", "take/../take/a/b", "take/"}) {
    spec.set_out(folder_ / out);
    const absl::Status status = CheckOutOfInputs(spec);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << out;
    EXPECT_THAT(status.message(), HasSubstr("the take"));
  }
  for (const char* out : {"take2", "result", "tak"}) {
    spec.set_out(folder_ / out);
    EXPECT_TRUE(CheckOutOfInputs(spec).ok()) << out;
  }
}

TEST_F(ResultsCheckTest, SaysWhereAndWhyInFull) {
  Change(0, [](v1::FrameReport& report) { report.set_frame("f9"); });
  Change(1, [](v1::FrameReport& report) { report.clear_keys(); });
  Change(2, [](v1::FrameReport& report) { report.set_images_fingerprint("another"); });
  infos_[4].set_state(v1::FRAME_STATE_FAILED);
  WriteBytes(File(3, "report.json"), "{");
  const auto found = FindIncompleteFrames(job_, infos_);
  ASSERT_TRUE(found.ok()) << found.status();
  const char* const why[] = {"was computed from something else", "was computed from something else",
                             "its images, scan or start changed since they were read",
                             "report.json is missing, damaged or of an older format",
                             "is in another state than its report says"};
  ASSERT_EQ(found->size(), 5u);
  for (size_t i = 0; i < 5; ++i) {
    EXPECT_EQ((*found)[i].position, i);
    EXPECT_EQ((*found)[i].why, why[i]);
    EXPECT_EQ((*found)[i].inputs_changed, i == 2);
  }
}

TEST_F(ResultsCheckTest, AFailedFrameThatReportsSuccessIsIncomplete) {
  infos_[3].set_state(v1::FRAME_STATE_DEGRADED);
  EXPECT_THAT(Incomplete(), ElementsAre("f3: is in another state than its report says"));
  infos_[3].set_state(v1::FRAME_STATE_CANCELLED);
  EXPECT_THAT(Incomplete(), IsEmpty());
}

TEST_F(ResultsCheckTest, FramesWithoutFolderAreIncomplete) {
  fs::remove_all(folder_ / "f1");
  const auto found = FindIncompleteFrames(job_, infos_);
  ASSERT_TRUE(found.ok()) << found.status();
  ASSERT_EQ(found->size(), 1u);
  EXPECT_EQ(found->front().position, 1u);
  EXPECT_FALSE(found->front().inputs_changed);
  fs::remove_all(folder_.path());
  EXPECT_THAT(Incomplete(),
              ElementsAre("f0: its folder is gone", "f1: its folder is gone", "f2: its folder is gone",
                          "f3: its folder is gone", "f4: its folder is gone"));
  fs::create_directory(folder_.path());
}

TEST_F(ResultsCheckTest, FramesAloneNeedNoNeighbours) {
  Change(1, [](v1::FrameReport& report) {
    report.clear_temporal();
    report.mutable_options()->set_frames_alone(true);
  });
  EXPECT_THAT(Incomplete(), IsEmpty());
}

TEST_F(ResultsCheckTest, AFirstFrameThatFailedIsRefinedByTheNext) {
  infos_[0].set_state(v1::FRAME_STATE_FAILED);
  Change(0, [](v1::FrameReport& report) {
    report.set_state(v1::FRAME_STATE_FAILED);
    report.clear_temporal();
  });
  EXPECT_THAT(Incomplete(), ElementsAre("f1: its neighbours' refinement is missing"));
}

TEST(TooManyRepairs, SaysWhatKeepsHappening) {
  EXPECT_EQ(
      TooManyRepairs("/out", "f1", "mesh.ply is missing"),
      absl::AbortedError("/out: frame f1: mesh.ply is missing, although it was registered several times; "
                         "keep other programs from changing its files, and register again"));
}

}  // namespace
}  // namespace weft
