#include "services/tools/cli/output_guard.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>

#include "services/tools/cli/command_line.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/test_terminal.h"

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

TEST(OutputGuard, AsksSomebodyAtATerminal) {
  const TempFolder folder;
  const std::string file = folder / "board.json";
  WriteBytes(file, "{}");
  const auto may = [&](const std::string& answer) {
    const TestTerminal terminal({STDIN_FILENO, STDERR_FILENO});
    terminal.Type(answer + "\n");
    std::clearerr(stdin);
    std::cin.clear();
    const bool is_ok = OutputGuard().MayReplace(file, "a board").ok();
    EXPECT_THAT(terminal.Shown(), HasSubstr(file + " is there already: a board. Overwrite it? [y/N] "));
    return is_ok;
  };
  for (const char* yes : {"y", "Yes", " YES "}) EXPECT_TRUE(may(yes)) << yes;
  for (const char* no : {"", "n", "yessir"}) EXPECT_FALSE(may(no)) << no;
  const TestTerminal half({STDERR_FILENO});
  EXPECT_FALSE(OutputGuard().MayReplace(file, "a board").ok());
  EXPECT_EQ(half.Shown(), "");
}

TEST(OutputGuard, AFolderOfSomethingElseIsNoTemplates) {
  const TempFolder folder;
  const std::string out = folder / "shirt";
  const OutputGuard guard;
  EXPECT_TRUE(MayWriteTemplateFolder(out, guard).ok());
  WriteBytes(out + "/clouds/0001.ply", "of a build that was stopped");
  WriteBytes(out + "/report.html", "");
  WriteBytes(out + "/.hidden", "");
  EXPECT_TRUE(MayWriteTemplateFolder(out, guard).ok());
  WriteBytes(out + "/letters.txt", "");
  const absl::Status other = MayWriteTemplateFolder(out, guard);
  EXPECT_EQ(other.code(), absl::StatusCode::kAlreadyExists);
  EXPECT_THAT(
      std::string(other.message()),
      HasSubstr(out + ": is there already: a folder of something else, it has letters.txt; name another "
                      "place, or overwrite it with --force"));
  WriteBytes(out + "/template.json", "");
  EXPECT_THAT(std::string(MayWriteTemplateFolder(out, guard).message()),
              HasSubstr("template.json: is there already: a template, and results may have its vertices"));
}

TEST(OutputGuard, SaysWhichPartOfAPathIsThere) {
  const TempFolder folder;
  EXPECT_EQ(MissingParent(folder / "a"), "");
  EXPECT_EQ(MissingParent(folder / "a/b/c"), (folder / "a/b/c") + ": the folder " + (folder / "a/b") +
                                                 " is missing (" + folder.path() + " is there)");
  EXPECT_EQ(MissingParent((folder / "a/b") + "/"), (folder / "a/b") + "/: the folder " + (folder / "a") +
                                                       " is missing (" + folder.path() + " is there)");
}

}  // namespace
}  // namespace weft
