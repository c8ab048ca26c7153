#include "services/tools/cli/upload_inputs.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

namespace weft {
namespace {

TEST(UploadInputs, TellNamesOfADaemonFromPaths) {
  EXPECT_TRUE(IsOfDaemon("take:20260101-a"));
  EXPECT_TRUE(IsOfDaemon("library:shirt"));
  EXPECT_TRUE(IsOfDaemon("job:20260101-1"));
  for (const char* path : {"", "take", "/takes/take:1", "./library:shirt", "./job:1"})
    EXPECT_FALSE(IsOfDaemon(path)) << path;
}

TEST(UploadInputs, NameFilesAsADaemonOfThisMachineFindsThem) {
  for (const char* name : {"take:20260101-a", "library:shirt", "job:20260101-1", ""})
    EXPECT_EQ(NameAtDaemon(name), name);
  EXPECT_EQ(NameAtDaemon("x/../rig.json"), (std::filesystem::current_path() / "rig.json").string());
}

TEST(AbsolutePaths, AreThoseOfTheWorkingFolder) {
  const std::string here = std::filesystem::current_path().string();
  EXPECT_EQ(AbsolutePath("a/../b/./rig.json"), here + "/b/rig.json");
  EXPECT_EQ(AbsolutePath("/a/../rig.json"), "/rig.json");
}

TEST(AbsolutePaths, LeaveWhatADaemonHolds) {
  v1::RegistrationSpec spec;
  spec.set_dump("take:20260101-a");
  spec.set_rig("rig.json");
  spec.set_board("library:shirt-board");
  spec.set_out("out");
  const v1::RegistrationSpec absolute = WithAbsolutePaths(spec);
  const std::string here = std::filesystem::current_path().string();
  EXPECT_EQ(absolute.dump(), "take:20260101-a");
  EXPECT_EQ(absolute.rig(), here + "/rig.json");
  EXPECT_EQ(absolute.board(), "library:shirt-board");
  EXPECT_EQ(absolute.out(), here + "/out");
  // What was not given is not the working folder.
  EXPECT_EQ(absolute.garment(), "");
  EXPECT_EQ(absolute.driving().avatar(), "");
}

}  // namespace
}  // namespace weft
