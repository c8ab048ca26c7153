// weft job plan: what it refuses before and while frames are registered. tests/system plans whole jobs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "services/tools/cli/commands.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/run_command.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

class CommandJobPlan : public ::testing::Test {
 protected:
  CommandRun Plan(std::vector<std::string> more) const {
    more.insert(more.begin(), {"plan", folder_ / "dump", "--rig", folder_ / "rig.json", "--board",
                               folder_ / "board.json", "--template", folder_ / "shirt"});
    return RunCommand(AddJobPlanCommand, std::move(more));
  }

  const TempFolder folder_;
};

TEST_F(CommandJobPlan, ThePilotNeedsAPlace) {
  const CommandRun run = Plan({"--scratch", folder_ / "none"});
  EXPECT_EQ(run.status,
            absl::UnavailableError((folder_ / "none") + ": no folder can be made there; --scratch DIR gives "
                                                        "another place"));
}

TEST_F(CommandJobPlan, LeavesNothingBehind) {
  const std::string scratch = folder_ / "scratch";
  std::filesystem::create_directories(scratch);
  const CommandRun run = Plan({"--scratch", scratch});
  EXPECT_EQ(run.status.code(), absl::StatusCode::kNotFound) << run.status;
  EXPECT_THAT(run.message(), HasSubstr(folder_.path()));
  EXPECT_TRUE(std::filesystem::is_empty(scratch));
}

TEST_F(CommandJobPlan, OptionsAreCheckedFirst) {
  const CommandRun option = Plan({"--scratch", folder_ / "none", "--set", "decode.none=1"});
  EXPECT_EQ(option.status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(option.message(), HasSubstr("decode.none"));
  EXPECT_THAT(Plan({"--preset", "worst"}).message(), HasSubstr("\"worst\" is none of best, paper"));
}

}  // namespace
}  // namespace weft
