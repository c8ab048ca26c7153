#include "services/tools/cli/completion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>

#include "services/tools/cli/command_line.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

class CompletionTest : public ::testing::Test {
 protected:
  CompletionTest() {
    CLI::App* take = app_.add_subcommand("take", "Takes. More of it");
    take->add_subcommand("record", "Record a take");
    take->add_subcommand("replay", "Replay a take")
        ->add_option("--mode", mode_, "It's the way. Not the speed")
        ->check(OneOf({"fast", "exact"}));
  }

  // What bash offers for these words, the last of which is being written.
  std::string Offered(const std::string& words, int count) const {
    WriteBytes(folder_ / "completion", BashCompletion(app_));
    const std::string script = "source '" + (folder_ / "completion") + "'; COMP_WORDS=(" + words +
                               "); COMP_CWORD=" + std::to_string(count - 1) +
                               "; _weft; echo -n \"${COMPREPLY[@]}\"";
    WriteBytes(folder_ / "ask", script);
    FILE* bash = popen(("bash '" + (folder_ / "ask") + "' 2>&1").c_str(), "r");
    std::string answer;
    for (int c = fgetc(bash); c != EOF; c = fgetc(bash)) answer += static_cast<char>(c);
    pclose(bash);
    return answer;
  }

  TempFolder folder_;
  CLI::App app_{"Weft", "weft"};
  std::string mode_;
};

TEST_F(CompletionTest, OffersCommandsAndValuesInBash) {
  EXPECT_EQ(Offered("weft ta", 2), "take");
  EXPECT_EQ(Offered("weft take re", 3), "record replay");
  EXPECT_EQ(Offered("weft take replay --mo", 4), "--mode");
  EXPECT_EQ(Offered("weft take replay --mode ''", 5), "fast exact");
  EXPECT_EQ(Offered("weft take replay --mode e", 5), "exact");
  // Files are what bash completes by itself then.
  EXPECT_EQ(Offered("weft take record x", 4), "");
}

TEST_F(CompletionTest, DescribesOptionsInZsh) {
  const std::string script = ZshCompletion(app_);
  EXPECT_THAT(script, StartsWith("#compdef weft\n"));
  EXPECT_THAT(script, HasSubstr("'take:Takes'"));
  EXPECT_THAT(script, HasSubstr("'--mode:It'\\''s the way'"));
  EXPECT_THAT(script, HasSubstr("('weft take replay --mode') compadd -- fast exact; return ;;"));
}

}  // namespace
}  // namespace weft
