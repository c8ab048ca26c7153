#include "services/cli/command_line.h"

namespace weft {

CLI::App* AddCommand(CLI::App& app, const std::string& name, const std::string& description,
                     const std::string& examples) {
  CLI::App* command = app.add_subcommand(name, description);
  command->option_defaults()->always_capture_default();
  if (!examples.empty()) command->footer("Examples:\n" + examples);
  return command;
}

}  // namespace weft
