// weft evaluate, and with --against.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "services/formats/files/json_file.h"
#include "services/tools/cli/commands.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/run_command.h"
#include "weft/v1/comparison.pb.h"
#include "weft/v1/evaluation.pb.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

// Results of meshes of another program: a square of 100 mm that rises, three frames.
class CommandEvaluate : public ::testing::Test {
 protected:
  CommandEvaluate() {
    Make(low_, 0);
    Make(high_, 2);
  }
  // The square of the second frame is `more_mm` higher than that of the first.
  void Make(const std::string& result, int more_mm) const {
    std::vector<std::string> words = {"garment", "import", "--out", result};
    for (int frame = 0; frame < 3; ++frame) {
      const int z = frame == 1 ? more_mm : 0;
      const std::string file = absl::StrCat(folder_.path(), "/", more_mm, "_", frame, ".obj");
      WriteBytes(file, absl::StrCat("v 0 0 ", z, "\nv 100 0 ", z, "\nv 100 100 ", z, "\nv 0 100 ", z,
                                    "\nf 1 2 3\nf 1 3 4\n"));
      words.insert(words.begin() + 2 + frame, file);
    }
    const CommandRun run = RunCommand(AddGarmentCommand, words);
    EXPECT_TRUE(run.status.ok()) << run.status;
  }
  CommandRun Evaluate(std::vector<std::string> words) const {
    words.insert(words.begin(), {"evaluate", low_, "--quick"});
    return RunCommand(AddEvaluateCommand, std::move(words));
  }

  const TempFolder folder_;
  const std::string low_ = folder_ / "low", high_ = folder_ / "high", out_ = folder_ / "out";
};

TEST_F(CommandEvaluate, PrintsTheVerdictBeforeTheMeasures) {
  const CommandRun run = Evaluate({"--no-truth", "--out", out_});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(run.out, ::testing::StartsWith("good: 3 frames\n\nself-intersections: none\nnote "));
  EXPECT_THAT(run.out, HasSubstr("left out on request (--no-truth)"));
  EXPECT_THAT(run.out, ::testing::EndsWith("\nreport   " + out_ + "/report.html\n"));
  for (const char* file : {"evaluation.json", "frames.csv", "cameras.csv", "report.html"})
    EXPECT_TRUE(std::filesystem::exists(out_ + "/" + file)) << file;
  EXPECT_EQ(Evaluate({}).out.find("report "), std::string::npos) << "none was written";
}

TEST_F(CommandEvaluate, JsonIsThatOfTheReport) {
  const CommandRun run = Evaluate({"--out", out_, "--json"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  v1::Evaluation printed, written;
  ASSERT_TRUE(ParseJson(run.out, "evaluation", printed).ok()) << run.out;
  ASSERT_TRUE(ReadJsonFile(out_ + "/evaluation.json", written).ok());
  EXPECT_EQ(printed.SerializeAsString(), written.SerializeAsString());
  EXPECT_EQ(printed.frames_size(), 3);
}

TEST_F(CommandEvaluate, AnotherResultStandsBesideIt) {
  const CommandRun run = Evaluate({"--against", high_, "--out", out_});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(run.out, HasSubstr("A        " + low_ + "\nB        " + high_ + "\n"));
  EXPECT_THAT(run.out, HasSubstr("meshes   vertices are 0.667 mm apart in the mean"));
  EXPECT_THAT(run.out, ::testing::EndsWith("\nreport   " + out_ + "/report.html\n"));
  EXPECT_TRUE(std::filesystem::exists(out_ + "/comparison.json"));
  v1::Comparison compared;
  ASSERT_TRUE(ParseJson(Evaluate({"--against", high_, "--json"}).out, "comparison", compared).ok());
}

TEST_F(CommandEvaluate, TheReportDoesNotReplaceThatOfAResult) {
  for (const std::string& out : {low_, high_}) {
    const CommandRun run = Evaluate({"--against", high_, "--out", out});
    EXPECT_EQ(run.status, absl::InvalidArgumentError("--out " + out +
                                                     ": is the result itself, whose report.html would "
                                                     "be replaced; give a folder of its own, " +
                                                     out + "/evaluation"));
    EXPECT_FALSE(std::filesystem::exists(out + "/frames.csv"));
  }
  EXPECT_TRUE(Evaluate({"--out", high_ + "/evaluation"}).status.ok());
}

TEST_F(CommandEvaluate, OptionsThatDoNotGoTogetherAreRefused) {
  EXPECT_THAT(Evaluate({"--truth", "t", "--no-truth"}).message(), HasSubstr("excludes"));
  EXPECT_THAT(Evaluate({"--against-rig", "rig.json"}).message(), HasSubstr("requires --against"));
  EXPECT_THAT(Evaluate({"--against-template", "shirt"}).message(), HasSubstr("requires --against"));
  EXPECT_THAT(Evaluate({"--against", high_, "--avatar", "a"}).message(), HasSubstr("excludes"));
  EXPECT_THAT(Evaluate({"--trials"}).message(), HasSubstr("requires --avatar"));
}

}  // namespace
}  // namespace weft
