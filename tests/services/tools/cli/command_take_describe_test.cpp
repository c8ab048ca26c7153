// weft take describe, search.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include "services/formats/files/json_file.h"
#include "services/studio/recording/take_file.h"
#include "services/tools/cli/commands.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/studio/recording/recorded_pattern.h"
#include "tests/services/tools/cli/run_command.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

class CommandTakeDescribe : public ::testing::Test {
 protected:
  CommandTakeDescribe() {
    unsetenv("WEFT_SERVER");
    PatternFrames cameras({"left"}, 64, 48, RawFormat::kMono8);
    RecordPattern(take_, cameras);
  }
  static CommandRun Take(std::vector<std::string> words) {
    return RunCommand(AddTakeDescribeCommands, std::move(words));
  }

  const TempFolder folder_;
  const std::string take_ = folder_ / "day/take";
};

TEST_F(CommandTakeDescribe, WhatIsNotGivenStays) {
  const CommandRun first =
      Take({"describe", take_, "--slate", "12A take 3", "--notes", "left sleeve is wet"});
  ASSERT_TRUE(first.status.ok()) << first.status;
  EXPECT_EQ(first.out, take_ + "  12A take 3\n");
  const CommandRun second = Take({"describe", take_, "--name", "walk"});
  EXPECT_EQ(second.out, take_ + "  12A take 3  walk\n");
  const auto file = ReadTakeFileStrictly(take_);
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->take.notes(), "left sleeve is wet");
  // An empty text takes it away.
  EXPECT_EQ(Take({"describe", take_, "--slate", ""}).out, take_ + "  walk\n");
}

TEST_F(CommandTakeDescribe, JsonIsTheTake) {
  const CommandRun run = Take({"describe", take_, "--name", "walk", "--json"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  v1::Take take;
  ASSERT_TRUE(ParseJson(run.out, "take", take).ok()) << run.out;
  EXPECT_EQ(take.name(), "walk");
}

TEST_F(CommandTakeDescribe, SaysWhatIsMissing) {
  const CommandRun nothing = Take({"describe", take_});
  EXPECT_EQ(nothing.status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(nothing.message(), HasSubstr("--slate, --name or --notes"));
  const CommandRun remote = Take({"describe", "take:20260131-104500-1a2b3c4d", "--name", "walk"});
  EXPECT_EQ(remote.status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(remote.message(), HasSubstr("--server HOST:PORT"));
  EXPECT_EQ(Take({"describe", folder_ / "none", "--name", "walk"}).status.code(),
            absl::StatusCode::kNotFound);
}

TEST_F(CommandTakeDescribe, SearchListsTakesThatHaveAllWords) {
  ASSERT_TRUE(Take({"describe", take_, "--slate", "12R", "--name", "slow walk"}).status.ok());
  const CommandRun found = Take({"search", "WALK", "12r", "--in", folder_.path()});
  ASSERT_TRUE(found.status.ok()) << found.status;
  EXPECT_THAT(found.out, ::testing::StartsWith(take_ + "  "));
  EXPECT_THAT(found.out, HasSubstr(" sets  12R  slow walk\n"));
  EXPECT_EQ(Take({"search", "jump", "--in", folder_.path()}).out,
            "no take in " + folder_.path() + " has these words\n");
  EXPECT_EQ(Take({"search", "jump", "--in", folder_.path(), "--json"}).out, "");
  v1::Take take;
  ASSERT_TRUE(ParseJson(Take({"search", "walk", "--in", folder_.path(), "--json"}).out, "take", take).ok());
  EXPECT_EQ(take.slate(), "12R");
}

}  // namespace
}  // namespace weft
