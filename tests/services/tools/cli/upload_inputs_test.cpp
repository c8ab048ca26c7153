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

}  // namespace
}  // namespace weft
