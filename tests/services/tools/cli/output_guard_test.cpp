#include "services/tools/cli/output_guard.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "services/tools/cli/command_line.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

// Tests have no terminal: nobody can be asked.
TEST(OutputGuard, RefusesToReplaceAFileUnasked) {
  const TempFolder folder;
  const std::string file = folder / "board.json";
  CLI::App app;
  OutputGuard guard;
  guard.AddTo(app);
  EXPECT_TRUE(guard.MayReplace(file, "a board").ok());
  std::ofstream(file) << "{}";
  const absl::Status refused = guard.MayReplace(file, "a board");
  EXPECT_EQ(refused.code(), absl::StatusCode::kAlreadyExists);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("--force"));
  app.parse("--force");
  EXPECT_TRUE(guard.MayReplace(file, "a board").ok());
}

TEST(OutputGuard, NamesTheFolderThatIsMissing) {
  const TempFolder folder;
  EXPECT_TRUE(CheckParentFolder(folder / "take").ok());
  EXPECT_TRUE(CheckParentFolder((folder / "take") + "/").ok());
  EXPECT_TRUE(CheckParentFolder("take").ok());
  const absl::Status missing = CheckParentFolder(folder / "mispelt/takes/take");
  EXPECT_EQ(missing.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(missing.message()), HasSubstr("mispelt/takes is missing"));
  EXPECT_FALSE(std::filesystem::exists(folder / "mispelt"));
}

TEST(CommandLine, SaysOfANumberWhatIsWrongWithIt) {
  const std::string digits(309, '7');
  EXPECT_EQ(WithoutHugeNumbers("--seconds: Value -2 not in range 0.000000 to " + digits + ".000000"),
            "--seconds: Value -2 is negative");
  EXPECT_EQ(WithoutHugeNumbers("--tag-mm: Value 0 not in range 0.000000 to " + digits + ".000000"),
            "--tag-mm: Value 0 must be above 0");
  EXPECT_EQ(WithoutHugeNumbers("--fps: Value 2000 not in range 0.1 to 1000"),
            "--fps: Value 2000 not in range 0.1 to 1000");
  CLI::App app;
  double seconds = 0;
  app.add_option("--seconds", seconds)->type_name("S");
  app.parse("--seconds nan");
  EXPECT_EQ(CheckFinite(app).code(), absl::StatusCode::kInvalidArgument);
  app.parse("--seconds 2");
  EXPECT_TRUE(CheckFinite(app).ok());
}

}  // namespace
}  // namespace weft
