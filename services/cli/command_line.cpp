#include "services/cli/command_line.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "base/nearest_word.h"

namespace weft {

CLI::App* AddCommand(CLI::App& app, const std::string& name, const std::string& description,
                     const std::string& examples) {
  CLI::App* command = app.add_subcommand(name, description);
  command->option_defaults()->always_capture_default();
  if (!examples.empty()) command->footer("Examples:\n" + examples);
  return command;
}

CLI::Validator OneOf(std::vector<std::string> names) {
  const std::string listed = absl::StrJoin(names, ",");
  return {[names = std::move(names)](std::string& value) {
            if (std::find(names.begin(), names.end(), value) != names.end()) return std::string();
            return absl::StrCat("\"", value, "\" is none of ", absl::StrJoin(names, ", "),
                                DidYouMean(value, names));
          },
          absl::StrCat("{", listed, "}")};
}

CLI::Option* AddServerOption(CLI::App& command, std::string& server, const std::string& description) {
  return command.add_option("--server", server, description)->type_name("ADDRESS")->envname("WEFT_SERVER");
}

}  // namespace weft
