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

// A program with a group, an option of its own, one with values, and a command with an option group.
class WholeScript : public ::testing::Test {
 protected:
  WholeScript() {
    app_.add_flag("-q,--quiet", quiet_, "Say less. Errors stay");
    CLI::App* take = app_.add_subcommand("take", "Takes: all of them\nMore lines");
    CLI::App* replay = take->add_subcommand("replay", "Replay a take");
    replay->add_option("--mode,--how", mode_, "It's the way")->check(OneOf({"fast", "exact"}));
    replay->add_option("TAKE", take_, "Which");
    replay->add_flag("--quiet", quiet_, "Say nothing");
    replay->add_option_group("")->add_option("--of-group", what_, "One of a group");
  }

  CLI::App app_{"Weft", "weft"};
  std::string mode_, take_, what_;
  bool quiet_ = false;
};

TEST_F(WholeScript, IsThisInBash) {
  EXPECT_EQ(BashCompletion(app_), R"(# Completion of weft for bash, as `weft completion bash` prints it.
_weft() {
  local word=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD-1]}
  local command=weft commands= options= i
  COMPREPLY=()
  for ((i = 1; i < COMP_CWORD; ++i)); do
    case "$command ${COMP_WORDS[i]}" in
      'weft take'|'weft take replay') command+=" ${COMP_WORDS[i]}" ;;
    esac
  done
  case "$command $previous" in
    'weft take replay --mode'|'weft take replay --how') COMPREPLY=($(compgen -W 'fast exact' -- "$word")); return ;;
  esac
  case $command in
    'weft') commands='take' options='-h --help -q --quiet' ;;
    'weft take') commands='replay' options='-h --help -q --quiet' ;;
    'weft take replay') commands='' options='-h --help --mode --how --quiet --of-group' ;;
  esac
  if [[ $word == -* ]]; then
    COMPREPLY=($(compgen -W "$options" -- "$word"))
  elif [[ -n $commands ]]; then
    COMPREPLY=($(compgen -W "$commands" -- "$word"))
  fi
}
complete -o default -F _weft weft
)");
}

TEST_F(WholeScript, IsThisInZsh) {
  EXPECT_EQ(ZshCompletion(app_), R"(#compdef weft
# Completion of weft for zsh, as `weft completion zsh` prints it.
local command=weft word
local -a commands options
for word in ${words[2,CURRENT-1]}; do
  case "$command $word" in
    ('weft take'|'weft take replay') command+=" $word" ;;
  esac
done
case "$command ${words[CURRENT-1]}" in
  ('weft take replay --mode'|'weft take replay --how') compadd -- fast exact; return ;;
esac
case $command in
  ('weft')
    commands=('take:Takes: all of them')
    options=('-h:Print this help message and exit'
      '--help:Print this help message and exit'
      '-q:Say less'
      '--quiet:Say less') ;;
  ('weft take')
    commands=('replay:Replay a take')
    options=('-h:Print this help message and exit'
      '--help:Print this help message and exit'
      '-q:Say less'
      '--quiet:Say less') ;;
  ('weft take replay')
    commands=()
    options=('-h:Print this help message and exit'
      '--help:Print this help message and exit'
      '--mode:It'\''s the way'
      '--how:It'\''s the way'
      '--quiet:Say nothing'
      '--of-group:One of a group') ;;
esac
if [[ $PREFIX == -* ]]; then
  _describe option options
elif (( $#commands )); then
  _describe command commands
else
  _files
fi
)");
}

}  // namespace
}  // namespace weft
