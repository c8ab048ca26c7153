#include "services/tools/cli/command_line.h"

#include <algorithm>
#include <cmath>
#include <regex>
#include <set>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "base/length_unit.h"
#include "base/nearest_word.h"
#include "services/ground/process/exit_status.h"
#include "services/tools/cli/output_guard.h"

namespace weft {

std::string WithoutHugeNumbers(const std::string& parse_error) {
  static const std::regex no_bound(R"(Value (\S+) not in range \S+ (to|-) [0-9]{40,}\S*)");
  std::smatch found;
  if (!std::regex_search(parse_error, found, no_bound)) return parse_error;
  double value = 0;
  const bool is_number = absl::SimpleAtod(found[1].str(), &value) && std::isfinite(value);
  const char* why = !is_number ? " is no finite number" : value < 0 ? " is negative" : " must be above 0";
  return absl::StrCat(found.prefix().str(), "Value ", found[1].str(), why, found.suffix().str());
}

absl::Status CheckFinite(const CLI::App& command) {
  static const std::set<std::string> units = {"FLOAT", "N",   "S",  "MS", "MM", "PX",     "HZ",   "FPS",
                                              "DEG",   "GIB", "GB", "M",  "CM", "FACTOR", "DAYS", "HOURS"};
  for (const CLI::Option* option : command.get_options()) {
    const std::string type = option->get_type_name().substr(0, option->get_type_name().find(':'));
    if (!units.contains(type)) continue;
    for (const std::string& text : option->results()) {
      double value = 0;
      if (absl::SimpleAtod(text, &value) && !std::isfinite(value))
        return absl::InvalidArgumentError(
            absl::StrCat(option->get_name(), ": Value ", text, " is no finite number"));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckOut(const CLI::App& command, bool is_quiet) {
  // What these make cannot be made again, so it should not lie where nobody looks for it.
  static const std::set<std::string> for_good = {"take", "pattern", "template", "rig", "dataset"};
  const CLI::Option* out = command.get_option_no_throw("--out");
  if (out == nullptr || out->count() == 0) return absl::OkStatus();
  const std::string path = out->as<std::string>();
  if (path.empty()) return absl::InvalidArgumentError("--out is empty; name where to write");
  const CLI::App* group = command.get_parent();
  const bool is_file = out->get_type_name() == "FILE";
  if (is_file || (group != nullptr && for_good.contains(group->get_name()))) return CheckParentFolder(path);
  if (const std::string missing = MissingParent(path); !missing.empty() && !is_quiet)
    PrintWarning(absl::StrCat(missing, "; the command makes it"));
  return absl::OkStatus();
}

CLI::App* AddCommand(CLI::App& app, const std::string& name, const std::string& description,
                     const std::string& examples) {
  CLI::App* command = app.add_subcommand(name, description);
  command->option_defaults()->always_capture_default();
  if (!examples.empty()) command->footer("Examples:\n" + examples);
  return command;
}

CLI::App* AddGroup(CLI::App& app, const std::string& name, const std::string& description,
                   const std::string& examples) {
  CLI::App* group = AddCommand(app, name, description, examples);
  group->require_subcommand(1);
  return group;
}

CLI::Validator OneOf(std::vector<std::string> names) {
  const std::string listed = absl::StrJoin(names, ",");
  return {[names = std::move(names)](std::string& value) {
            if (std::ranges::find(names, value) != names.end()) return std::string();
            return absl::StrCat("\"", value, "\" is none of ", absl::StrJoin(names, ", "),
                                DidYouMean(value, names));
          },
          absl::StrCat("{", listed, "}")};
}

CLI::Validator OneLengthUnit() {
  std::vector<std::string> names;
  for (const UnitOfLength& unit : UnitsOfLength()) names.emplace_back(unit.name);
  const std::string listed = absl::StrJoin(names, ",");
  return {[names = std::move(names)](std::string& value) {
            if (LengthUnitNamed(value)) return std::string();
            return absl::StrCat("\"", value, "\" is none of ", absl::StrJoin(names, ", "));
          },
          absl::StrCat("{", listed, "}")};
}

CLI::Option* AddServerOption(CLI::App& command, std::string& server, const std::string& description) {
  return AddOption(command, "--server ADDRESS", server, description)->envname("WEFT_SERVER");
}

}  // namespace weft
