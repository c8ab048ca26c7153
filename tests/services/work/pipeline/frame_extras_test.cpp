#include "services/work/pipeline/frame_extras.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const std::vector<std::string> kExtraFrames = {"0000", "0001", "0002"};

class Extras : public ::testing::Test {
 protected:
  void AddScans(const std::vector<std::string>& names) {
    std::filesystem::create_directories(scans_);
    for (const std::string& name : names) WriteBytes(scans_ + "/" + name, "ply");
  }
  std::string ScanOf(const std::string& frame) {
    const auto folder = ScanFolder::List(scans_);
    EXPECT_TRUE(folder.ok()) << folder.status();
    const auto path = folder->Of(frame);
    return path.ok() ? std::filesystem::path(*path).filename().string()
                     : std::string(path.status().message());
  }
  absl::StatusOr<std::vector<std::string>> Check(const std::vector<std::string>& frames = kExtraFrames,
                                                 bool is_live = false) {
    v1::RegistrationOptions options;
    options.set_scans(scans_);
    return CheckExtras(options, kExtraFrames, frames, is_live);
  }

  TempFolder folder_;
  const std::string scans_ = folder_ / "scans";
};

TEST_F(Extras, ScansAreFoundByNameOrByTheirOnlyNumber) {
  AddScans(
      {"0000.ply", "frame_0001.PLY", "2.pcd", "frame_12_take_3.ply", ".0007.ply", "notes.txt", "0008.obj"});
  EXPECT_EQ(ScanOf("0000"), "0000.ply");
  EXPECT_EQ(ScanOf("0001"), "frame_0001.PLY");
  EXPECT_EQ(ScanOf("frame1"), "frame_0001.PLY");
  EXPECT_EQ(ScanOf("0002"), "2.pcd");
  EXPECT_EQ(ScanOf("0003"), "");
  EXPECT_EQ(ScanOf("0012"), "");
  EXPECT_EQ(ScanOf("0007"), "");
  EXPECT_EQ(ScanOf("0008"), "");
  EXPECT_EQ(ScanOf("frame_12_take_3"), "frame_12_take_3.ply");
}

TEST_F(Extras, PlyGoesBeforePcdAndTwoScansOfAFrameAreRefused) {
  AddScans({"0000.ply", "0000.pcd", "scan1.ply", "mesh1.ply", "0002.ply", "scan_2.ply"});
  EXPECT_EQ(ScanOf("0000"), "0000.ply");
  EXPECT_THAT(ScanOf("0001"), AllOf(HasSubstr("mesh1.ply and scan1.ply"), HasSubstr("frame 0001")));
  EXPECT_EQ(ScanOf("0002"), "0002.ply");
  EXPECT_EQ(Check().status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(Extras, AFolderThatIsNotThereOrHasNoScanIsRefused) {
  EXPECT_EQ(Check().status().code(), absl::StatusCode::kNotFound);
  AddScans({"notes.txt"});
  EXPECT_THAT(std::string(Check().status().message()), HasSubstr("no file there ends in .ply or .pcd"));
  AddScans({"shirt_a.ply", "shirt_b.ply"});
  EXPECT_THAT(std::string(Check().status().message()),
              AllOf(HasSubstr("It has shirt_a.ply, shirt_b.ply, the frames are 0000, 0001, 0002"),
                    HasSubstr("0000.ply")));
  WriteBytes(folder_ / "file", "x");
  v1::RegistrationOptions options;
  options.set_scans(folder_ / "file");
  EXPECT_THAT(std::string(CheckExtras(options, kExtraFrames, kExtraFrames, false).status().message()),
              HasSubstr("is no folder"));
}

TEST_F(Extras, FramesWithoutAScanAndScansWithoutAFrameAreSaid) {
  AddScans({"0000.ply", "0002.ply"});
  EXPECT_THAT(Check().value(), ElementsAre(HasSubstr("1 of 3 frames have no scan: 0001")));
  EXPECT_THAT(Check({"0000"}).value(), IsEmpty());
  EXPECT_FALSE(Check({"0001"}).ok());
  AddScans({"0001.ply", "0009.ply"});
  EXPECT_THAT(Check().value(), ElementsAre(HasSubstr("1 scan is of no frame: 0009.ply")));
}

TEST_F(Extras, ScansOfALiveTakeMayComeLater) {
  AddScans({});
  EXPECT_TRUE(Check({"0000"}, true).ok());
  std::filesystem::remove(scans_);
  EXPECT_FALSE(Check({"0000"}, true).ok());
}

TEST_F(Extras, StartsHaveAMeshOfAFrame) {
  v1::RegistrationOptions options;
  options.set_starts(folder_ / "before");
  const auto check = [&] { return CheckExtras(options, kExtraFrames, kExtraFrames, false); };
  EXPECT_EQ(check().status().code(), absl::StatusCode::kNotFound);
  std::filesystem::create_directories(folder_ / "before/0007");
  WriteBytes(folder_ / "before/0007/mesh.ply", "ply");
  EXPECT_THAT(std::string(check().status().message()),
              AllOf(HasSubstr("has no <frame>/mesh.ply"), HasSubstr("it has those of 0007")));
  std::filesystem::create_directories(folder_ / "before/0001");
  WriteBytes(folder_ / "before/0001/mesh.ply", "ply");
  EXPECT_THAT(check().value(),
              ElementsAre(HasSubstr("2 of 3 frames have no mesh to start from: 0000, 0002")));
}

TEST_F(Extras, SecondFormatsOfAScanAreNoStrangersAndOthersAreCounted) {
  AddScans({"0000.ply", "0000.pcd", "0001.PCD", "0002.ply", "a.ply", "b.ply"});
  const auto notes = Check();
  ASSERT_TRUE(notes.ok()) << notes.status();
  EXPECT_THAT(*notes, ElementsAre(scans_ + ": 2 scans are of no frame: a.ply, b.ply"));
  EXPECT_EQ(ScanOf("0001"), "0001.PCD");
  EXPECT_THAT(ScanFolder::List(scans_)->names(),
              ElementsAre("0000.pcd", "0000.ply", "0001.PCD", "0002.ply", "a.ply", "b.ply"));
}

TEST_F(Extras, NumbersAreComparedWithoutLeadingZeros) {
  AddScans({"scan_0.ply", "scan_00010.ply", "7_of_9.ply"});
  EXPECT_EQ(ScanOf("000"), "scan_0.ply");
  EXPECT_EQ(ScanOf("frame10"), "scan_00010.ply");
  EXPECT_EQ(ScanOf("0001"), "");
  EXPECT_EQ(ScanOf("7"), "") << "of two numbers";
  EXPECT_EQ(ScanOf("frame"), "") << "of none";
}

TEST_F(Extras, StartsOfALiveTakeMayComeLaterAndWholeOnesAreSilent) {
  v1::RegistrationOptions options;
  options.set_starts(folder_ / "before");
  std::filesystem::create_directories(folder_ / "before");
  const auto check = [&](bool is_live) { return CheckExtras(options, kExtraFrames, kExtraFrames, is_live); };
  EXPECT_EQ(check(false).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(check(true).value(), IsEmpty());
  for (const std::string& frame : kExtraFrames)
    WriteBytes(folder_ / ("before/" + frame + "/mesh.ply"), "ply");
  EXPECT_THAT(check(false).value(), IsEmpty());
  EXPECT_THAT(CheckExtras({}, kExtraFrames, kExtraFrames, false).value(), IsEmpty());
}

}  // namespace
}  // namespace weft
