// weft completion: scripts for shells.
#include <cstdio>
#include <memory>
#include <string>

#include "services/ground/process/command_option.h"
#include "services/tools/cli/completion.h"

namespace weft {

void AddCompletionCommand(CLI::App& app, CommandLine& line) {
  CLI::App* command = AddCommand(app, "completion",
                                 "Print the script for completion of weft's commands, options and values in "
                                 "a shell. The Debian package installs both.",
                                 "  weft completion zsh > ~/.zfunc/_weft\n"
                                 "  source <(weft completion bash)");
  const auto shell = std::make_shared<std::string>();
  AddRequired(*command, "SHELL", *shell, "bash or zsh")->check(OneOf({"bash", "zsh"}));
  command->callback([&app, &line, shell] {
    line.run = [&app, shell] {
      std::fputs((*shell == "zsh" ? ZshCompletion(app) : BashCompletion(app)).c_str(), stdout);
      return absl::OkStatus();
    };
  });
}

}  // namespace weft
