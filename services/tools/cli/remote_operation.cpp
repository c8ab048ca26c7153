#include "services/tools/cli/remote_operation.h"

#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "base/timed_id.h"
#include "services/formats/verdict/verdict.h"
#include "services/ground/process/exit_status.h"
#include "services/ground/process/stop_on_signal.h"
#include "services/tools/cli/kind_options.h"
#include "services/tools/cli/progress.h"
#include "services/tools/cli/upload_inputs.h"
#include "services/tools/client/operation_client.h"
#include "services/work/spec/kind_info.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

// What the command line says of an operation.
struct RemoteRun {
  std::string server;
  v1::OperationSpec spec;
  std::string out;
  bool quiet = false;
};

// "take verify".
std::string CommandWords(const CLI::App& command) {
  const CLI::App* parent = command.get_parent();
  if (parent == nullptr || parent->get_parent() == nullptr) return command.get_name();
  return absl::StrCat(CommandWords(*parent), " ", command.get_name());
}

// As the daemon names it.
template <typename Added>
void AddNamed(const v1::NamedValue& from, const std::string& value, Added* added) {
  added->set_name(from.name());
  added->set_value(value);
}

absl::StatusOr<RemoteRun> RunOf(const CLI::App& command, const v1::WorkKindInfo& kind,
                                const std::string& server) {
  RemoteRun run;
  run.server = server;
  run.spec.set_command(kind.name());
  std::vector<const CLI::Option*> others;
  const v1::WorkSpec work = WorkOf(kind, command, &others);
  for (const v1::NamedValue& input : work.inputs())
    AddNamed(input, NameAtDaemon(input.value()), run.spec.add_inputs());
  for (const v1::NamedValue& option : work.options())
    AddNamed(option, option.value(), run.spec.add_options());
  for (const CLI::Option* other : others) {
    const std::string name =
        other->get_lnames().empty() ? other->get_name(true) : other->get_lnames().front();
    if (name == "out") {
      run.out = other->results().front();
    } else if (name == "json") {
      run.spec.set_json(true);
    } else if (name != "server" && name != "threads") {
      return absl::InvalidArgumentError(absl::StrCat(
          "--", name, ": a daemon does not take it; leave it out, or run the command without --server"));
    }
  }
  if (kind.out() == v1::WORK_OUT_NAMED) {
    const std::string name = fs::path(run.out).lexically_normal().filename().string();
    run.spec.set_out_name(name.empty() || name == "." || name == ".." ? "result" : name);
  }
  return run;
}

// A bad verdict stands in the output that was printed.
absl::Status OutcomeOfOperation(const v1::Operation& operation) {
  if (operation.state() == v1::JOB_STATE_DONE) {
    v1::Verdict verdict;
    if (operation.exit_status() == kExitFailed) verdict.set_grade(v1::GRADE_BAD);
    return VerdictStatus(verdict);
  }
  if (operation.state() == v1::JOB_STATE_CANCELLED)
    return absl::CancelledError("the operation was cancelled");
  return absl::Status(operation.exit_status() == kExitBadInput ? absl::StatusCode::kInvalidArgument
                                                               : absl::StatusCode::kInternal,
                      operation.message());
}

absl::StatusOr<v1::Operation> Follow(OperationClient& client, const std::string& id, bool quiet,
                                     const std::stop_token& stop) {
  std::string step;
  std::optional<Progress> bar;
  constexpr uint64_t kFollowSteps = 1000;
  const auto show = [&](const v1::Operation& operation) {
    if (operation.step().empty()) return;
    if (operation.step() != step) {
      bar.reset();
      bar.emplace(operation.step(), kFollowSteps, ProgressVisible(quiet), ProgressUnit::kPercent);
      step = operation.step();
    }
    bar->Set(static_cast<uint64_t>(operation.share_done() * kFollowSteps), kFollowSteps);
  };
  absl::StatusOr<v1::Operation> operation = client.Watch(id, show, stop);
  if (!stop.stop_requested()) return operation;
  WEFT_RETURN_IF_ERROR(client.Cancel(id).status());
  return client.Watch(id, nullptr);
}

absl::Status RunAtDaemon(const RemoteRun& run) {
  const StopOnSignal signals;
  WEFT_ASSIGN_OR_RETURN(const auto connection, RegistrationClient::Connect(run.server));
  OperationClient client(*connection);
  v1::StartOperationRequest request;
  *request.mutable_spec() = run.spec;
  request.set_idempotency_key(NewTimedId());
  absl::StatusOr<v1::Operation> operation = client.Start(request);
  if (!operation.ok()) return operation.status();
  operation = Follow(client, operation->id(), run.quiet, signals.token());
  if (!operation.ok()) return operation.status();
  if (!run.quiet) {
    for (const std::string& note : operation->notes()) PrintWarning(note);
  }
  if (operation->state() == v1::JOB_STATE_DONE && !run.spec.out_name().empty() && !run.out.empty()) {
    std::optional<Progress> fetching;
    const auto fetched = [&](size_t done, size_t total) {
      if (!fetching) fetching.emplace("fetch", total, ProgressVisible(run.quiet));
      fetching->Set(done, total);
    };
    const std::string folder = fs::absolute(run.out).lexically_normal().parent_path().string();
    WEFT_RETURN_IF_ERROR(client.FetchFiles(operation->id(), folder, fetched));
  }
  std::fputs(operation->output().c_str(), stdout);
  if (!operation->take_id().empty() && !run.spec.json())
    std::printf("take:%s\n", operation->take_id().c_str());
  return OutcomeOfOperation(*operation);
}

}  // namespace

void RunHereOrAtDaemon(CLI::App& command, CommandLine& line, std::function<absl::Status()> here,
                       std::function<std::optional<ConfinedFiles>()> confined) {
  const auto server = std::make_shared<std::string>();
  AddServerOption(
      command, *server,
      "Have the daemon at HOST:PORT do it, with files of its machine, take:ID and job:ID; --out is here. "
      "--server '' does it here where WEFT_SERVER is set");
  command.callback([&command, &line, server, here = std::move(here), confined = std::move(confined)] {
    if (server->empty()) {
      if (confined) line.confined = confined();
      line.run = here;
      return;
    }
    line.run = [&command, &line, server]() -> absl::Status {
      const v1::WorkKindInfo* kind = FindKindInfo(CommandWords(command));
      if (kind == nullptr || kind->start() != v1::WORK_START_OPERATION)
        return absl::UnimplementedError("daemons do not run this command");
      WEFT_ASSIGN_OR_RETURN(RemoteRun run, RunOf(command, *kind, *server));
      run.quiet = line.quiet;
      return RunAtDaemon(run);
    };
  });
}

}  // namespace weft
