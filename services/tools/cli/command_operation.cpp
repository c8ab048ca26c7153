// weft operation: commands that a daemon runs for its clients.
#include <cstdio>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "services/ground/process/exit_status.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/job_view.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/cli/remote_command.h"
#include "services/tools/client/operation_client.h"
#include "services/work/spec/kind_info.h"

namespace weft {
namespace {

struct OperationCommandOptions {
  std::string server;
  std::string id;
  int limit = 20;
  bool json = false;
};

using OperationContext = RemoteContext<OperationClient, OperationCommandOptions>;

void PrintOperation(const v1::Operation& operation) {
  std::printf("%s  %-9s  weft %s", operation.id().c_str(), JobStateWord(operation.state()),
              operation.spec().command().c_str());
  if (!operation.about().empty()) std::printf(" %s", operation.about().c_str());
  if (operation.state() == v1::JOB_STATE_RUNNING && !operation.step().empty()) {
    std::printf("  (%s, %.0f %%)", operation.step().c_str(), 100 * operation.share_done());
  }
  if (!operation.message().empty()) std::printf("  (%s)", operation.message().c_str());
  std::printf("\n");
}

absl::Status ListOperations(const OperationContext& context) {
  WEFT_ASSIGN_OR_RETURN(const v1::ListOperationsResponse list, context.client.List(context.options.limit));
  if (context.options.json) return PrintJsonMessage(list);
  for (const std::string& warning : list.warnings()) PrintWarning(warning);
  if (list.operations().empty()) std::printf("no operations at %s\n", context.options.server.c_str());
  for (const v1::Operation& operation : list.operations()) PrintOperation(operation);
  return absl::OkStatus();
}

absl::Status CancelOperation(const OperationContext& context) {
  WEFT_ASSIGN_OR_RETURN(const v1::Operation operation, context.client.Cancel(context.options.id));
  if (context.options.json) return PrintJsonMessage(operation);
  PrintOperation(operation);
  return absl::OkStatus();
}

absl::Status DeleteOperation(const OperationContext& context) {
  WEFT_ASSIGN_OR_RETURN(const v1::Operation operation, context.client.Delete(context.options.id));
  if (context.options.json) return PrintJsonMessage(operation);
  std::printf("operation %s is deleted\n", operation.id().c_str());
  return absl::OkStatus();
}

std::string OperationNames() {
  std::vector<std::string> names;
  for (const v1::WorkKindInfo* kind : AllKindInfos()) {
    if (kind->start() == v1::WORK_START_OPERATION) names.push_back(kind->name());
  }
  return absl::StrJoin(names, ", ");
}

void AddOperationId(CLI::App& command, OperationCommandOptions& options) {
  AddRequired(command, "OPERATION", options.id, "Its id, as `weft operation list` prints it");
}

}  // namespace

void AddOperationCommand(CLI::App& app, CommandLine& line) {
  CLI::App* group = AddGroup(
      app, "operation",
      absl::StrCat(
          "Commands that a daemon runs for its clients, by their option --server: ", OperationNames(), "."));
  const RemoteCommand<OperationClient, OperationCommandOptions> commands[] = {
      {"list", "List the operations of a daemon, the newest first",
       "  weft operation list --server 127.0.0.1:7411", AddListLimit, ListOperations, true, true},
      {"cancel", "Stop an operation; nothing of it stays",
       "  weft operation cancel 20260131-104500-1a2b3c4d --server 127.0.0.1:7411", AddOperationId,
       CancelOperation, true, true},
      {"delete",
       "Delete an operation that has ended, with the files that it wrote; a take that it made stays",
       "  weft operation delete 20260131-104500-1a2b3c4d --server 127.0.0.1:7411", AddOperationId,
       DeleteOperation, true, true}};
  for (const auto& command : commands) AddRemoteCommand(*group, line, command);
}

}  // namespace weft
