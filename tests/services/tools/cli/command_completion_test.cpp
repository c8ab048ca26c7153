// weft completion.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/tools/cli/completion.h"
#include "tests/services/tools/cli/run_command.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

// The command is itself one that is completed.
TEST(CommandCompletion, PrintsTheScriptOfTheShellThatIsNamed) {
  CLI::App app("Weft", "weft");
  CommandLine line;
  AddCompletionCommand(app, line);
  const CommandRun bash = RunCommand(AddCompletionCommand, {"completion", "bash"});
  ASSERT_TRUE(bash.status.ok()) << bash.status;
  EXPECT_EQ(bash.out, BashCompletion(app));
  EXPECT_THAT(bash.out, HasSubstr("completion"));
  const CommandRun zsh = RunCommand(AddCompletionCommand, {"completion", "zsh"});
  ASSERT_TRUE(zsh.status.ok()) << zsh.status;
  EXPECT_EQ(zsh.out, ZshCompletion(app));
  EXPECT_THAT(zsh.out, StartsWith("#compdef weft\n"));
}

TEST(CommandCompletion, OtherShellsAreRefusedWithThoseThereAre) {
  EXPECT_THAT(RunCommand(AddCompletionCommand, {"completion", "fish"}).message(),
              AllOf(HasSubstr("fish"), HasSubstr("bash, zsh")));
  EXPECT_THAT(RunCommand(AddCompletionCommand, {"completion"}).message(), HasSubstr("SHELL is required"));
}

}  // namespace
}  // namespace weft
