// From the request of an operation to a command line.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/server/daemon/calls/resolve_input.h"
#include "weft/v1/operations.pb.h"
#include "weft/v1/work.pb.h"

namespace weft {

// Null: no operation has this name.
const v1::WorkKindInfo* FindOperationKind(const std::string& command);

// InvalidArgument names the field: an unknown command, an input or option that it does not have, one that is
// missing or given twice, a name of the output that is none.
absl::Status CheckOperationSpec(const v1::OperationSpec& spec);

struct OperationCommand {
  std::vector<std::string> arguments;  // of `weft`, which is run in the folder of its output
  std::vector<std::string> inputs;     // as they were resolved, in the order of the spec
};

// Precondition: CheckOperationSpec. Errors of `resolve`.
absl::StatusOr<OperationCommand> CommandOf(const v1::OperationSpec& spec, const ResolveInput& resolve);

}  // namespace weft
