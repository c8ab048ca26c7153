#include "services/server/daemon/work/operation_command.h"

#include <algorithm>
#include <map>
#include <set>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "base/status_macros.h"
#include "capture/file/plain_text.h"
#include "services/server/daemon/calls/request_check.h"
#include "services/server/rpc/error_detail.h"
#include "services/server/rpc/operation_kinds.h"

namespace weft {
namespace {

constexpr int kMostInputs = 1000, kMostOptions = 100;

absl::Status BadSpec(const std::string& field, const std::string& problem, const std::string& remedy) {
  return FieldError(absl::StatusCode::kInvalidArgument, {"spec." + field, problem, remedy});
}

absl::Status UnknownCommand(const std::string& command) {
  std::vector<std::string> known;
  for (const OperationKind& kind : OperationKinds()) known.emplace_back(kind.command);
  return BadSpec("command", absl::StrCat("\"", EscapedText(command), "\" is none that a daemon runs"),
                 absl::StrCat("give one of ", absl::StrJoin(known, ", ")));
}

absl::Status CheckInputs(const v1::OperationSpec& spec, const OperationKind& kind) {
  if (spec.inputs_size() > kMostInputs) return BadSpec("inputs", "are too many", "give at most 1000");
  std::map<std::string, int> given;
  for (const v1::OperationInput& input : spec.inputs()) {
    WEFT_RETURN_IF_ERROR(CheckOneLine("spec.inputs", input.value()));
    if (input.value().empty())
      return BadSpec("inputs", absl::StrCat(EscapedText(input.name()), " is empty"), "");
    ++given[input.name()];
  }
  std::vector<std::string> names;
  for (const OperationInputKind& input : kind.inputs) {
    names.emplace_back(input.name);
    const int count = given[input.name];
    if (count == 0 && input.is_required) {
      return BadSpec("inputs", absl::StrCat(input.name, " is missing"),
                     absl::StrCat(kind.command, " needs it"));
    }
    if (count > 1 && !input.may_repeat) {
      return BadSpec("inputs", absl::StrCat(input.name, " is given ", count, " times"), "give it once");
    }
    given.erase(input.name);
  }
  if (given.empty()) return absl::OkStatus();
  return BadSpec("inputs",
                 absl::StrCat("\"", EscapedText(given.begin()->first), "\" is no input of ", kind.command),
                 absl::StrCat("it has ", absl::StrJoin(names, ", ")));
}

absl::Status CheckOptions(const v1::OperationSpec& spec, const OperationKind& kind) {
  if (spec.options_size() > kMostOptions) return BadSpec("options", "are too many", "give at most 100");
  for (const v1::OperationOption& option : spec.options()) {
    WEFT_RETURN_IF_ERROR(CheckOneLine("spec.options", option.value()));
    if (std::find(kind.options.begin(), kind.options.end(), option.name()) != kind.options.end()) continue;
    return BadSpec(
        "options", absl::StrCat("\"", EscapedText(option.name()), "\" is no option of ", kind.command),
        kind.options.empty() ? "it has none" : absl::StrCat("it has ", absl::StrJoin(kind.options, ", ")));
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status CheckOperationSpec(const v1::OperationSpec& spec) {
  const OperationKind* kind = FindOperationKind(spec.command());
  if (kind == nullptr) return UnknownCommand(spec.command());
  WEFT_RETURN_IF_ERROR(CheckInputs(spec, *kind));
  WEFT_RETURN_IF_ERROR(CheckOptions(spec, *kind));
  WEFT_RETURN_IF_ERROR(CheckPlainName("spec.out_name", spec.out_name()));
  const bool named = !spec.out_name().empty();
  // The name is an argument of its own, and must not look like an option.
  if (named && spec.out_name().front() == '-')
    return BadSpec("out_name", "begins with a dash", "choose another one");
  if (named == (kind->out == OperationOut::kNamed)) return absl::OkStatus();
  return named
             ? BadSpec("out_name", absl::StrCat("is given, and ", kind->command, " has none"), "leave it out")
             : BadSpec("out_name", "is missing", "name what the command writes");
}

absl::StatusOr<std::vector<std::string>> ArgumentsOf(const v1::OperationSpec& spec,
                                                     const ResolveInput& resolve) {
  const OperationKind& kind = *FindOperationKind(spec.command());
  std::vector<std::string> arguments = absl::StrSplit(kind.command, ' ');
  for (const v1::OperationOption& option : spec.options()) {
    // With its value in one word, so that no value is an option.
    arguments.push_back(option.value().empty() ? absl::StrCat("--", option.name())
                                               : absl::StrCat("--", option.name(), "=", option.value()));
  }
  std::vector<std::string> positional;
  for (const v1::OperationInput& input : spec.inputs()) {
    WEFT_ASSIGN_OR_RETURN(const std::string path,
                          resolve(absl::StrCat("spec.inputs.", input.name()), input.value()));
    const auto of_name =
        std::find_if(kind.inputs.begin(), kind.inputs.end(),
                     [&](const OperationInputKind& known) { return known.name == input.name(); });
    if (of_name->is_positional) {
      positional.push_back(path);
    } else {
      arguments.push_back(absl::StrCat("--", input.name(), "=", path));
    }
  }
  if (kind.out != OperationOut::kNone) {
    arguments.push_back(absl::StrCat("--out=", kind.out == OperationOut::kTake ? "take" : spec.out_name()));
  }
  if (spec.json()) arguments.emplace_back("--json");
  arguments.emplace_back("--");
  arguments.insert(arguments.end(), positional.begin(), positional.end());
  return arguments;
}

}  // namespace weft
