// weft motion make, list, show, import.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "figure/motion_generator.h"
#include "services/formats/figure/motion_file.h"
#include "services/tools/cli/commands.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/run_command.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

CommandRun MotionCommand(std::vector<std::string> words) {
  words.insert(words.begin(), "motion");
  return RunCommand(AddMotionCommand, std::move(words));
}

TEST(CommandMotion, ListsEveryKindThatCanBeMade) {
  const CommandRun run = MotionCommand({"list"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  std::istringstream lines(run.out);
  std::string line;
  for (const MotionKindInfo& kind : MotionKinds()) {
    ASSERT_TRUE(std::getline(lines, line));
    EXPECT_THAT(line, StartsWith(std::string(kind.name) + " "));
    EXPECT_THAT(line, HasSubstr(std::string(kind.about)));
  }
  EXPECT_FALSE(std::getline(lines, line));
}

TEST(CommandMotion, MakesTheMotionThatItsOptionsAskFor) {
  const TempFolder folder;
  const CommandRun run = MotionCommand({"make", "--kind", "squat", "--seconds", "2", "--fps", "30", "--seed",
                                        "5", "--out", folder / "a.motion"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  const auto made = ReadMotion(folder / "a.motion");
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->fps, 30);
  EXPECT_NEAR(made->DurationS(), 2, 0.05);
  EXPECT_EQ(run.out, folder / "a.motion" + std::string(": squat, 2.0 s, ") +
                         std::to_string(made->poses.size()) + " poses\n");
  const auto expected = MakeMotion({MotionKind::kSquat, 2, 30, 5});
  ASSERT_TRUE(expected.ok()) << expected.status();
  ASSERT_TRUE(WriteMotion(folder / "b.motion", *expected).ok());
  EXPECT_EQ(MotionHash(*made), MotionHash(*ReadMotion(folder / "b.motion")));
}

TEST(CommandMotion, ShowsWhatAMotionHoldsAndDrawsIt) {
  const TempFolder folder;
  ASSERT_TRUE(
      MotionCommand({"make", "--kind", "wave", "--seconds", "1", "--out", folder / "a.motion"}).status.ok());
  const CommandRun run = MotionCommand({"show", folder / "a.motion", "--picture", folder / "a.svg"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(run.out,
              HasSubstr("poses at 60 a second, hash " + MotionHash(*ReadMotion(folder / "a.motion"))));
  EXPECT_THAT(run.out, HasSubstr("farthest, deg"));
  EXPECT_THAT(ReadBytes(folder / "a.svg"), HasSubstr("<svg"));
}

TEST(CommandMotion, AKindThatIsNoneIsAnsweredWithThoseThereAre) {
  const TempFolder folder;
  const CommandRun run = MotionCommand({"make", "--kind", "fly", "--out", folder / "a.motion"});
  EXPECT_EQ(run.status.code(), absl::StatusCode::kInvalidArgument);
  for (const MotionKindInfo& kind : MotionKinds())
    EXPECT_THAT(run.message(), HasSubstr(std::string(kind.name)));
  EXPECT_EQ(MotionCommand({"make", "--seconds=-1", "--out", folder / "a.motion"}).status.code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_FALSE(std::filesystem::exists(folder / "a.motion"));
}

TEST(CommandMotion, ImportNamesTheOptionThatIsWrong) {
  const TempFolder folder;
  const auto import = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"import", folder / "walk.bvh", "--out", folder / "walk.motion"});
    return MotionCommand(more);
  };
  EXPECT_THAT(import({"--joint", "chest"}).message(),
              HasSubstr("--joint \"chest\" is not of the form OURS=THEIRS"));
  for (const char* axis : {"w", "-", "xy", "--z"}) {
    const CommandRun run = import({"--up=" + std::string(axis)});
    EXPECT_EQ(run.status.code(), absl::StatusCode::kInvalidArgument) << axis;
    EXPECT_THAT(run.message(), HasSubstr("expected x, y, z, -x, -y or -z")) << axis;
  }
  EXPECT_THAT(import({"--sides", "swapped"}).message(), HasSubstr("auto, as-named, exchanged"));
  const CommandRun missing = import({"--up", "z"});
  EXPECT_EQ(missing.status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(missing.message(), HasSubstr(folder / "walk.bvh"));
}

}  // namespace
}  // namespace weft
