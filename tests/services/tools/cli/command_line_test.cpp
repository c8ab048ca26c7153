#include "services/tools/cli/command_line.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <string>
#include <vector>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

TEST(CommandLineParts, TakeOneOfSeveralNames) {
  const CLI::Validator one = OneOf({"fast", "exact"});
  std::string value = "fast";
  EXPECT_EQ(one(value), "");
  value = "Fast";
  EXPECT_THAT(one(value), HasSubstr("\"Fast\" is none of fast, exact"));
  EXPECT_EQ(one.get_description(), "{fast,exact}");
}

TEST(CommandLineParts, TakeFiniteNumbersAlone) {
  CLI::App app;
  double speed = 0;
  app.add_option("--speed", speed);
  app.parse("--speed 3.5");
  EXPECT_TRUE(CheckFinite(app).ok());
  for (const char* text : {"inf", "-inf", "nan"}) {
    app.clear();
    app.parse("--speed=" + std::string(text));
    const absl::Status status = CheckFinite(app);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(std::string(status.message()), HasSubstr("--speed")) << text;
  }
}

TEST(CommandLineParts, ShowExamplesBelowTheOptions) {
  CLI::App app("Weft", "weft");
  AddCommand(app, "take", "Looks at takes.", "  weft take info T");
  EXPECT_THAT(app.get_subcommand("take")->help(), HasSubstr("Examples:\n  weft take info T"));
}

TEST(CommandLineParts, SayWhyANumberIsNone) {
  const std::string digits(45, '9');
  EXPECT_EQ(WithoutHugeNumbers("--fps: Value nan not in range 0 - " + digits + ".5 and more"),
            "--fps: Value nan is no finite number and more");
  EXPECT_EQ(WithoutHugeNumbers("--fps: Value -0.5 not in range 0 to " + digits),
            "--fps: Value -0.5 is negative");
}

TEST(CommandLineParts, TakeUnitsOfLength) {
  const CLI::Validator unit = OneLengthUnit();
  std::string value = "in";
  EXPECT_EQ(unit(value), "");
  value = "mile";
  EXPECT_EQ(unit(value), "\"mile\" is none of mm, cm, m, in, ft");
}

constexpr char kNotGiven[] = "not given";

// Parses `weft GROUP make --out PATH`, whose --out has this type.
absl::Status OutOf(const std::string& group, const std::string& type, const std::string& path, bool is_quiet,
                   std::string* warned = nullptr) {
  CLI::App app("Weft", "weft");
  std::string out;
  CLI::App* command = AddCommand(*AddGroup(app, group, "A group."), "make", "Makes it.", "  weft make");
  AddOption(*command, "--out " + type, out, "Where to");
  std::vector<std::string> words = {group, "make"};
  if (path != kNotGiven) words.insert(words.end(), {"--out", path});
  std::reverse(words.begin(), words.end());
  app.parse(words);
  ::testing::internal::CaptureStderr();
  const absl::Status status = CheckOut(*command, is_quiet);
  const std::string said = ::testing::internal::GetCapturedStderr();
  if (warned != nullptr) *warned = said;
  return status;
}

TEST(CommandLineParts, LookForTheFolderOfWhatCannotBeMadeAgain) {
  const TempFolder folder;
  const std::string misspelt = folder / "mispelt/take";
  for (const char* group : {"take", "pattern", "template", "rig", "dataset"}) {
    EXPECT_TRUE(absl::IsNotFound(OutOf(group, "DIR", misspelt, false))) << group;
    EXPECT_TRUE(OutOf(group, "DIR", folder / "take", false).ok()) << group;
    EXPECT_TRUE(OutOf(group, "DIR", kNotGiven, false).ok()) << group;
  }
  std::string warned;
  EXPECT_TRUE(absl::IsNotFound(OutOf("export", "FILE", misspelt, false)));
  EXPECT_TRUE(OutOf("export", "DIR", misspelt, false, &warned).ok());
  EXPECT_EQ(warned, "weft: warning: " + misspelt + ": the folder " + (folder / "mispelt") + " is missing (" +
                        folder.path() + " is there); the command makes it\n");
  EXPECT_TRUE(OutOf("export", "DIR", misspelt, true, &warned).ok());
  EXPECT_EQ(warned, "");
  EXPECT_TRUE(OutOf("export", "DIR", folder / "out", false, &warned).ok());
  EXPECT_EQ(warned, "");
}

TEST(CommandLineParts, AnEmptyPlaceToWriteToIsRefused) {
  const absl::Status status = OutOf("export", "DIR", "", false);
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), testing::StartsWith("--out is empty; name where to write"));
}

TEST(CommandLineParts, AGroupNeedsACommandAndDefaultsAreShown) {
  CLI::App app("Weft", "weft");
  int count = 7;
  CLI::App* group = AddGroup(app, "take", "Takes.");
  AddOption(*AddCommand(*group, "info", "Shows one.", ""), "--count N", count, "How many");
  EXPECT_THROW(app.parse("take"), CLI::RequiredError);
  EXPECT_THAT(group->get_subcommand("info")->help(), HasSubstr("--count N=7 "));
  EXPECT_THAT(group->get_subcommand("info")->help(), testing::Not(HasSubstr("Examples")));
}

}  // namespace
}  // namespace weft
