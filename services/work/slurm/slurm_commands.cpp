#include "services/work/slurm/slurm_commands.h"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <limits>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "base/status_macros.h"
#include "services/work/executor/run_program.h"

namespace weft {
namespace {

constexpr std::chrono::seconds kCommandTimeout{20};
constexpr char kEnv[] = "/usr/bin/env";
constexpr char kWholeLists[] = "SLURM_BITSTR_LEN=0";
// squeue prints 3 kB for each element that runs, and scontrol shows the jobs of all users.
constexpr size_t kMostBytes = size_t{256} << 20;

absl::StatusOr<std::string> FindCommand(const std::string& name, const std::string& folder) {
  const char* path = getenv("PATH");
  const std::string where = !folder.empty() ? folder : absl::StrCat(path == nullptr ? "" : path, ":/usr/bin");
  for (const absl::string_view one : absl::StrSplit(where, ':', absl::SkipEmpty())) {
    std::string file = absl::StrCat(one, "/", name);
    if (access(file.c_str(), X_OK) == 0) return file;
  }
  return absl::NotFoundError(absl::StrCat(name, ": no such program in ", where,
                                          "; --slurm-folder needs the commands of Slurm on this machine "
                                          "(Debian: slurm-client)"));
}

// The line in which a command of Slurm says what went wrong.
std::string ErrorLine(const absl::Status& status) {
  std::string found;
  for (const absl::string_view line :
       absl::StrSplit(absl::string_view(status.message()), '\n', absl::SkipWhitespace())) {
    if (absl::StrContains(line, "error:") || found.empty()) found = std::string(line);
  }
  return std::string(absl::StripAsciiWhitespace(found));
}

}  // namespace

bool IsRefusedForGood(const std::string& printed) {
  for (const char* words :
       {"nvalid partition", "nvalid account", "nvalid qos", "nvalid time limit", "time limit is invalid",
        "nvalid feature", "nvalid option", "unrecognized option", "nvalid constraint",
        "nvalid generic resource", "node configuration is not available", "nvalid node name",
        "Memory specification can not be satisfied", "CPU count per node can not be satisfied",
        "ccess denied", "not permitted to use", "exceeds", "nvalid directive", "nvalid numeric value"}) {
    if (absl::StrContains(printed, words)) return true;
  }
  return false;
}

bool IsTooMany(const std::string& printed) {
  for (const char* words : {"nvalid job array specification",  // MaxArraySize, max_array_tasks
                            "unable to accept job",            // MaxJobCount
                            "job queue full",
                            "job submit limit",  // of an account, a user or a quality of service
                            "MaxSubmit"}) {
    if (absl::StrContains(printed, words)) return true;
  }
  return false;
}

absl::StatusOr<SlurmCommands> SlurmCommands::Find(const std::string& folder) {
  SlurmCommands commands;
  for (const auto& [name, file] : {std::pair<const char*, std::string*>{"sbatch", &commands.sbatch_},
                                   {"squeue", &commands.squeue_},
                                   {"scancel", &commands.scancel_},
                                   {"scontrol", &commands.scontrol_}}) {
    WEFT_ASSIGN_OR_RETURN(*file, FindCommand(name, folder));
  }
  return commands;
}

absl::StatusOr<std::string> SlurmCommands::Run(const std::string& program,
                                               const std::vector<std::string>& arguments) const {
  ProgramRun run;
  run.arguments = arguments;
  run.patience = kCommandTimeout;
  run.most_bytes = kMostBytes;
  return RunProgram(program, run);
}

absl::StatusOr<int64_t> SlurmCommands::Submit(const std::vector<std::string>& arguments) const {
  const absl::StatusOr<std::string> printed = Run(sbatch_, arguments);
  if (!printed.ok()) {
    const std::string line = ErrorLine(printed.status());
    const std::string all(printed.status().message());
    if (IsTooMany(all)) return absl::ResourceExhaustedError(line);
    return IsRefusedForGood(all) ? absl::FailedPreconditionError(line) : absl::UnavailableError(line);
  }
  int64_t id = 0;
  // "12" or "12;cluster".
  if (absl::SimpleAtoi(printed->substr(0, printed->find_first_of(";\n")), &id) && id > 0) return id;
  return absl::UnavailableError(absl::StrCat("sbatch printed \"", absl::StripAsciiWhitespace(*printed),
                                             "\" where the id of a job was expected"));
}

absl::StatusOr<int> SlurmCommands::MostElements() const {
  const absl::StatusOr<std::string> config = Run(scontrol_, {"show", "config"});
  if (!config.ok()) return absl::UnavailableError(ErrorLine(config.status()));
  int most = std::numeric_limits<int>::max();
  for (const absl::string_view line : absl::StrSplit(*config, '\n')) {
    const std::pair<absl::string_view, absl::string_view> parts =
        absl::StrSplit(line, absl::MaxSplits('=', 1));
    const absl::string_view name = absl::StripAsciiWhitespace(parts.first);
    int value = 0;
    if (!absl::SimpleAtoi(absl::StripAsciiWhitespace(parts.second), &value)) continue;
    // Indexes are below MaxArraySize; jobs, elements among them, are fewer than MaxJobCount.
    if (name == "MaxArraySize") most = std::min(most, value);
    if (name == "MaxJobCount") most = std::min(most, value - 1);
  }
  return std::max(1, most);
}

absl::StatusOr<std::vector<SlurmRecord>> SlurmCommands::Query() const {
  // Without the variable lists of waiting elements end after 64 characters.
  const absl::StatusOr<std::string> printed =
      Run(kEnv, {kWholeLists, squeue_, "--json", "--states=all", "--me"});
  if (printed.ok()) {
    absl::StatusOr<std::vector<SlurmRecord>> records = ParseSqueue(*printed);
    if (records.ok() || absl::IsUnavailable(records.status())) return records;
  }
  // A Slurm that was built without JSON.
  const absl::StatusOr<std::string> shown = Run(kEnv, {kWholeLists, scontrol_, "show", "job"});
  if (!shown.ok()) return absl::UnavailableError(ErrorLine(printed.ok() ? shown.status() : printed.status()));
  absl::StatusOr<std::vector<SlurmRecord>> records = ParseScontrolJobs(*shown);
  return records.ok() ? records : absl::UnavailableError(records.status().message());
}

absl::Status SlurmCommands::Cancel(const std::vector<std::string>& jobs) const {
  constexpr size_t kAtOnce = 500;
  for (size_t begin = 0; begin < jobs.size(); begin += kAtOnce) {
    std::vector<std::string> arguments = {"--quiet"};
    arguments.insert(arguments.end(), jobs.begin() + static_cast<std::ptrdiff_t>(begin),
                     jobs.begin() + static_cast<std::ptrdiff_t>(std::min(jobs.size(), begin + kAtOnce)));
    const absl::StatusOr<std::string> printed = Run(scancel_, arguments);
    // Jobs that have ended by now are no reason to try again.
    if (!printed.ok() && !absl::StrContains(printed.status().message(), "nvalid job id"))
      return absl::UnavailableError(ErrorLine(printed.status()));
  }
  return absl::OkStatus();
}

absl::Status SlurmCommands::SetThrottle(int64_t array_id, int running) const {
  const absl::StatusOr<std::string> printed = Run(
      scontrol_, {"update", absl::StrCat("JobId=", array_id), absl::StrCat("ArrayTaskThrottle=", running)});
  return printed.ok() ? absl::OkStatus() : absl::UnavailableError(ErrorLine(printed.status()));
}

}  // namespace weft
