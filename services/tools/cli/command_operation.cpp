// weft operation: commands that a daemon runs for its clients.
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "base/status_macros.h"
#include "services/ground/process/command_option.h"
#include "services/ground/process/exit_status.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/job_view.h"
#include "services/tools/cli/json_output.h"
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

absl::Status ListOperations(OperationClient& client, const OperationCommandOptions& options) {
  WEFT_ASSIGN_OR_RETURN(const v1::ListOperationsResponse list, client.List(options.limit));
  if (options.json) return PrintJsonMessage(list);
  for (const std::string& warning : list.warnings()) PrintWarning(warning);
  if (list.operations().empty()) std::printf("no operations at %s\n", options.server.c_str());
  for (const v1::Operation& operation : list.operations()) PrintOperation(operation);
  return absl::OkStatus();
}

absl::Status CancelOperation(OperationClient& client, const OperationCommandOptions& options) {
  WEFT_ASSIGN_OR_RETURN(const v1::Operation operation, client.Cancel(options.id));
  if (options.json) return PrintJsonMessage(operation);
  PrintOperation(operation);
  return absl::OkStatus();
}

absl::Status DeleteOperation(OperationClient& client, const OperationCommandOptions& options) {
  WEFT_ASSIGN_OR_RETURN(const v1::Operation operation, client.Delete(options.id));
  if (options.json) return PrintJsonMessage(operation);
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

using OperationAction = absl::Status (*)(OperationClient&, const OperationCommandOptions&);

void SetUpOperationCommand(CLI::App* command, CommandLine& line,
                           const std::shared_ptr<OperationCommandOptions>& options, OperationAction action) {
  AddServerOption(*command, options->server, "HOST:PORT of the daemon")->required();
  command->add_flag("--json", options->json, "Print JSON");
  command->callback([options, action, &line] {
    line.run = [options, action] {
      WEFT_ASSIGN_OR_RETURN(const auto connection, RegistrationClient::Connect(options->server));
      OperationClient client(*connection);
      return action(client, *options);
    };
  });
}

}  // namespace

void AddOperationCommand(CLI::App& app, CommandLine& line) {
  CLI::App* group = AddCommand(
      app, "operation",
      absl::StrCat(
          "Commands that a daemon runs for its clients, by their option --server: ", OperationNames(), "."),
      "");
  group->require_subcommand(1);
  const auto options = std::make_shared<OperationCommandOptions>();
  CLI::App* list = AddCommand(*group, "list", "List the operations of a daemon, the newest first",
                              "  weft operation list --server 127.0.0.1:7411");
  SetUpOperationCommand(list, line, options, ListOperations);
  AddOption(*list, "--limit N", options->limit, "At most this many", CLI::Range(1, 1000));
  CLI::App* cancel = AddCommand(*group, "cancel", "Stop an operation; nothing of it stays",
                                "  weft operation cancel 20260131-104500-1a2b3c4d --server 127.0.0.1:7411");
  SetUpOperationCommand(cancel, line, options, CancelOperation);
  cancel->add_option("OPERATION", options->id, "Its id, as `weft operation list` prints it")->required();
  CLI::App* remove = AddCommand(*group, "delete",
                                "Delete an operation that has ended, with the files that it wrote; a take "
                                "that it made stays",
                                "  weft operation delete 20260131-104500-1a2b3c4d --server 127.0.0.1:7411");
  SetUpOperationCommand(remove, line, options, DeleteOperation);
  remove->add_option("OPERATION", options->id, "Its id, as `weft operation list` prints it")->required();
}

}  // namespace weft
