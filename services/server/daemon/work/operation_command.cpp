#include "services/server/daemon/work/operation_command.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "base/status_macros.h"
#include "services/server/daemon/calls/request_check.h"
#include "services/server/rpc/error_detail.h"
#include "services/work/spec/kind_info.h"

namespace weft {
namespace {

absl::Status BadSpec(const SpecFault& fault) {
  return FieldError(absl::StatusCode::kInvalidArgument, {fault.field, fault.why, fault.remedy});
}

absl::Status BadOutName(const std::string& problem, const std::string& remedy) {
  return BadSpec({"spec.out_name", problem, remedy});
}

v1::WorkSpec WorkOf(const v1::OperationSpec& spec) {
  v1::WorkSpec work;
  work.set_kind(spec.command());
  const auto copy = [](const auto& from, v1::NamedValue& to) {
    to.set_name(from.name());
    to.set_value(from.value());
  };
  for (const v1::OperationInput& input : spec.inputs()) copy(input, *work.add_inputs());
  for (const v1::OperationOption& option : spec.options()) copy(option, *work.add_options());
  return work;
}

}  // namespace

const v1::WorkKindInfo* FindOperationKind(const std::string& command) {
  const v1::WorkKindInfo* kind = FindKindInfo(command);
  return kind != nullptr && kind->start() == v1::WORK_START_OPERATION ? kind : nullptr;
}

absl::Status CheckOperationSpec(const v1::OperationSpec& spec) {
  const v1::WorkKindInfo* kind = FindOperationKind(spec.command());
  if (kind == nullptr) return BadSpec(UnknownKind(spec.command(), v1::WORK_START_OPERATION, "spec.command"));
  if (const auto fault = FaultOfWork(*kind, WorkOf(spec), "spec")) return BadSpec(*fault);
  WEFT_RETURN_IF_ERROR(CheckPlainName("spec.out_name", spec.out_name()));
  const bool named = !spec.out_name().empty();
  // The name is an argument of its own, and must not look like an option.
  if (named && spec.out_name().front() == '-') return BadOutName("begins with a dash", "choose another one");
  if (named == (kind->out() == v1::WORK_OUT_NAMED)) return absl::OkStatus();
  return named ? BadOutName(absl::StrCat("is given, and ", kind->name(), " has none"), "leave it out")
               : BadOutName("is missing", "name what the command writes");
}

absl::StatusOr<OperationCommand> CommandOf(const v1::OperationSpec& spec, const ResolveInput& resolve) {
  const v1::WorkKindInfo& kind = *FindOperationKind(spec.command());
  OperationCommand command{absl::StrSplit(kind.name(), ' '), {}};
  std::vector<std::string>& arguments = command.arguments;
  for (const v1::OperationOption& option : spec.options()) {
    // With its value in one word, so that no value is an option.
    arguments.push_back(option.value().empty() ? absl::StrCat("--", option.name())
                                               : absl::StrCat("--", option.name(), "=", option.value()));
  }
  std::vector<std::string> positional;
  for (const v1::OperationInput& input : spec.inputs()) {
    const auto of_name =
        std::find_if(kind.inputs().begin(), kind.inputs().end(),
                     [&](const v1::WorkInputInfo& known) { return known.name() == input.name(); });
    WEFT_ASSIGN_OR_RETURN(const std::string path, resolve(absl::StrCat("spec.inputs.", input.name()),
                                                          of_name->item(), input.value()));
    command.inputs.push_back(path);
    if (of_name->is_positional()) {
      positional.push_back(path);
    } else {
      arguments.push_back(absl::StrCat("--", input.name(), "=", path));
    }
  }
  if (kind.out() != v1::WORK_OUT_NONE) {
    const bool is_take = kind.out() == v1::WORK_OUT_TAKE;
    arguments.push_back(absl::StrCat("--out=", is_take ? "take" : spec.out_name()));
  }
  if (spec.json()) arguments.emplace_back("--json");
  arguments.emplace_back("--");
  arguments.insert(arguments.end(), positional.begin(), positional.end());
  return command;
}

}  // namespace weft
