#include "services/work/pipeline/frame_inputs.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "services/formats/files/rig_file.h"
#include "services/work/pipeline/job_confinement.h"
#include "simulation/studio_rig.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

class FrameInputsTest : public ::testing::Test {
 protected:
  FrameInputsTest() {
    spec_.set_rig(folder_ / "rig.json");
    spec_.set_dump(folder_ / "take");
    EXPECT_TRUE(WriteRig(spec_.rig(), *MakeStudioRig("ring", {.cameras = 2})).ok());
    for (const char* frame : {"f0", "f1"})
      WriteBytes(folder_ / (std::string("take/") + frame + "/c00.png"), "pixels");
  }

  std::string Of(const std::string& frame) const {
    const auto now = FingerprintsNow::Open(spec_);
    EXPECT_TRUE(now.ok()) << now.status();
    return now->Of(frame);
  }
  static std::string Mark(const std::string& path) {
    const auto written = std::filesystem::last_write_time(path).time_since_epoch().count();
    return "+" + std::to_string(std::filesystem::file_size(path)) + "-" + std::to_string(written);
  }

  const TempFolder folder_;
  v1::RegistrationSpec spec_;
};

TEST_F(FrameInputsTest, AScanIsThatOfTheFrame) {
  EXPECT_EQ(ScanPath("f0", ""), "");
  const std::string scans = folder_ / "scans";
  EXPECT_EQ(ScanPath("f0", scans), "");
  WriteBytes(scans + "/f0.pcd", "points");
  EXPECT_EQ(ScanPath("f0", scans), scans + "/f0.pcd");
  WriteBytes(scans + "/f0.ply", "points");
  EXPECT_EQ(ScanPath("f0", scans), scans + "/f0.ply");
  WriteBytes(scans + "/scan_7.ply", "points");
  EXPECT_EQ(ScanPath("f07", scans), scans + "/scan_7.ply");
  EXPECT_EQ(ScanPath("f1", scans), "");
  WriteBytes(scans + "/other_7.ply", "points");
  EXPECT_EQ(ScanPath("f07", scans), "") << "two are none";
}

TEST_F(FrameInputsTest, AStartIsTheMeshOfAnEarlierResult) {
  EXPECT_EQ(StartPath("f0", ""), "");
  const std::string starts = folder_ / "starts";
  EXPECT_EQ(StartPath("f0", starts), "");
  WriteBytes(starts + "/f0/mesh.ply", "mesh");
  EXPECT_EQ(StartPath("f0", starts), starts + "/f0/mesh.ply");
  EXPECT_EQ(StartPath("f1", starts), "");
}

TEST_F(FrameInputsTest, FingerprintsTellSizeAndTimeOfScanAndStart) {
  const std::string alone = Of("f0"), scan = folder_ / "scans/f0.ply", start = folder_ / "starts/f0/mesh.ply";
  EXPECT_NE(alone, "");
  EXPECT_EQ(Of("f2"), "");
  WriteBytes(scan, "a scan");
  WriteBytes(start, "a mesh of an earlier run");
  EXPECT_EQ(Of("f0"), alone);
  spec_.mutable_options()->set_starts(folder_ / "starts");
  EXPECT_EQ(Of("f0"), alone + Mark(start));
  spec_.mutable_options()->set_scans(folder_ / "scans");
  EXPECT_EQ(Of("f0"), alone + Mark(scan) + Mark(start));
  EXPECT_NE(Mark(scan), Mark(start));
  spec_.mutable_options()->clear_starts();
  EXPECT_EQ(Of("f0"), alone + Mark(scan));
  std::filesystem::remove_all(folder_ / "take/f1");
  EXPECT_EQ(Of("f1"), "");
}

TEST_F(FrameInputsTest, FingerprintsNeedRigAndTake) {
  std::filesystem::remove_all(folder_ / "take");
  EXPECT_EQ(FingerprintsNow::Open(spec_).status().code(), absl::StatusCode::kNotFound);
  spec_.set_rig(folder_ / "none.json");
  EXPECT_EQ(FingerprintsNow::Open(spec_).status().code(), absl::StatusCode::kNotFound);
}

TEST(JobConfinement, ReadsInputsAndWritesResults) {
  v1::RegistrationSpec spec;
  EXPECT_TRUE(ConfinementOf(spec, {}).readable.empty());
  EXPECT_TRUE(ConfinementOf(spec, {}).writable.empty());
  spec.set_rig("/inputs/rig.json");
  spec.set_dump("/takes/t");
  spec.set_out("/results/t");
  spec.mutable_options()->set_starts("/starts");
  LinkRules links;
  const Confinement confinement = ConfinementOf(spec, links);
  EXPECT_EQ(confinement.readable, (std::vector<std::string>{"/inputs/rig.json", "/starts", "/takes/t"}));
  EXPECT_EQ(confinement.writable, std::vector<std::string>{"/results/t"});
  EXPECT_FALSE(confinement.may_run_programs);
}

TEST(JobConfinement, RunsProgramsForScansAndPcd) {
  v1::RegistrationSpec spec;
  spec.mutable_options()->set_cloud_format("ply");
  EXPECT_FALSE(ConfinementOf(spec, {}).may_run_programs);
  spec.mutable_options()->set_cloud_format("pcd");
  EXPECT_TRUE(ConfinementOf(spec, {}).may_run_programs);
  spec.mutable_options()->clear_cloud_format();
  spec.mutable_options()->set_scans("/scans");
  EXPECT_TRUE(ConfinementOf(spec, {}).may_run_programs);
}

}  // namespace
}  // namespace weft
