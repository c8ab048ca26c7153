// The commands of `weft` that a daemon runs for its clients.
#pragma once

#include <string_view>
#include <vector>

namespace weft {

// Before the id of a job where a command reads the folder of its results.
inline constexpr char kJobPrefix[] = "job:";

// A file or folder that a command reads.
struct OperationInputKind {
  const char* name;  // of the input, and of the command's option unless it is positional
  bool is_positional = false;
  bool is_required = true;
  bool may_repeat = false;
};

enum class OperationOut { kNone, kNamed, kTake };

struct OperationKind {
  const char* command;  // "take verify"
  std::vector<OperationInputKind> inputs;
  // Names of options that clients may give. None of them names a file.
  std::vector<const char*> options;
  OperationOut out = OperationOut::kNone;
  bool reads_besides = false;  // files that its inputs name
};

const std::vector<OperationKind>& OperationKinds();
// Null: no such command.
const OperationKind* FindOperationKind(std::string_view command);

}  // namespace weft
