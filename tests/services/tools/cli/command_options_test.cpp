// weft options.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "services/formats/files/json_file.h"
#include "services/formats/options/option_range.h"
#include "services/formats/options/option_text.h"
#include "services/tools/cli/commands.h"
#include "tests/services/tools/cli/run_command.h"
#include "weft/v1/command.pb.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

CommandRun Options(std::vector<std::string> words) {
  words.insert(words.begin(), "options");
  return RunCommand(AddOptionsCommand, std::move(words));
}

TEST(CommandOptions, ShowsThoseWhosePathContainsTheNameAlone) {
  const CommandRun run = Options({"inlier_radius"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  std::istringstream lines(run.out);
  std::string line;
  int options = 0;
  while (std::getline(lines, line)) {
    if (line.starts_with(' ')) continue;  // what the option means
    EXPECT_THAT(line, HasSubstr("inlier_radius"));
    ++options;
  }
  EXPECT_GE(options, 1);
}

TEST(CommandOptions, AValueThatIsNotTheDefaultIsToldWithIt) {
  constexpr char kPath[] = "triangulation.consensus.inlier_radius_mm";
  const CommandRun run = Options({kPath, "--set", std::string(kPath) + "=1.5"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(run.out, StartsWith(std::string(kPath) + "=1.5  (default "));
  EXPECT_THAT(run.out, HasSubstr("; mm; above 0, at most 1000)\n    Distance up to which a ray takes part"));
}

TEST(CommandOptions, ANameOfNoOptionIsAnsweredWithTheNearest) {
  const CommandRun run = Options({"triangulation.consensus.inlier_radius_cm"});
  EXPECT_EQ(run.status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(run.message(), HasSubstr("inlier_radius_cm: no such option; did you mean "
                                       "triangulation.consensus.inlier_radius_mm?"));
  EXPECT_EQ(run.out, "");
}

TEST(CommandOptions, JsonHasEveryOptionWithItsSentence) {
  const CommandRun run = Options({"--json"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  v1::OptionList list;
  ASSERT_TRUE(ParseJson(run.out, "options", list).ok());
  const auto all = std::count_if(AllOptions().begin(), AllOptions().end(),
                                 [](const OptionField& option) { return !option.IsGroup(); });
  EXPECT_EQ(list.options_size(), all);
  for (const v1::OptionInfo& info : list.options()) EXPECT_NE(info.text(), "") << info.path();
}

TEST(CommandOptions, TheFileReadsBackAsTheSameOptions) {
  const CommandRun run = Options({"--file", "--set", "decode.levels=2"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  v1::PipelineOptions read;
  const absl::Status status = AddOptionText(run.out, "options.txtpb", read);
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_EQ(read.decode().levels(), 2);
  EXPECT_EQ(OptionFileText(read), run.out);
}

TEST(CommandOptions, AFileIsNoJson) {
  EXPECT_THAT(Options({"--file", "--json"}).message(), HasSubstr("excludes"));
  EXPECT_THAT(Options({"--preset", "worst"}).message(), HasSubstr("\"worst\" is none of"));
}

TEST(CommandOptions, SeveralNamesShowThoseOfAny) {
  const auto paths = [](std::vector<std::string> words) {
    words.push_back("--json");
    std::vector<std::string> found;
    v1::OptionList list;
    EXPECT_TRUE(ParseJson(Options(words).out, "options", list).ok());
    for (const v1::OptionInfo& info : list.options()) found.push_back(info.path());
    return found;
  };
  const auto levels = paths({"decode.levels"}), radius = paths({"inlier_radius_mm"});
  ASSERT_EQ(levels.size(), 1u);
  EXPECT_EQ(paths({"decode.levels", "inlier_radius_mm"}).size(), levels.size() + radius.size());
  EXPECT_EQ(Options({"decode.levels", "xyzzy"}).message(), "xyzzy: no such option");
}

TEST(CommandOptions, APresetChangesValuesAndNotTheirDefaults) {
  const CommandRun best = Options({"--preset", "best"}), paper = Options({"--preset", "paper"});
  EXPECT_NE(best.out, paper.out);
  EXPECT_THAT(paper.out, HasSubstr("(default "));
  EXPECT_THAT(Options({"decode.levels"}).out, StartsWith("decode.levels="));
}

}  // namespace
}  // namespace weft
