// `weft`: the command line.
#include <CLI/CLI.hpp>

#include <signal.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <cstdio>
#include <exception>
#include <filesystem>
#include <regex>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/nearest_word.h"
#include "capture/file/plain_text.h"
#include "services/formats/verdict/verdict.h"
#include "services/ground/confinement/confinement.h"
#include "services/ground/process/exit_status.h"
#include "services/ground/process/freed_memory.h"
#include "services/ground/process/help.h"
#include "services/ground/process/no_threads.h"
#include "services/ground/process/process_limits.h"
#include "services/tools/cli/command_line.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/completion.h"
#include "services/tools/cli/progress.h"

namespace {

// What could have been meant: commands and options of a command, and options of those around it.
std::vector<std::string> NamesIn(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::App* one : command.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(one->get_name());
  for (const CLI::App* app = &command; app != nullptr; app = app->get_parent()) {
    for (const CLI::Option* option : app->get_options()) {
      if (option->get_group().empty()) continue;  // not for people
      for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    }
  }
  return names;
}

// The innermost subcommand that was named.
const CLI::App& NamedCommand(const CLI::App& app) {
  const std::vector<CLI::App*> named = app.get_subcommands();
  return named.empty() ? app : NamedCommand(*named.front());
}

std::string FullName(const CLI::App& app) {
  return app.get_parent() ? FullName(*app.get_parent()) + " " + app.get_name() : app.get_name();
}

int ParseFailure(const CLI::App& app, const CLI::ParseError& error) {
  if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) return app.exit(error);  // --help
  const CLI::App& command = NamedCommand(app);
  std::string what = error.what();
  static const std::regex too_often(": At Most 1 required but received ([0-9]+)");
  const bool is_too_often = std::regex_search(what, too_often);
  const std::vector<std::string> unknown = is_too_often ? std::vector<std::string>() : app.remaining(true);
  if (is_too_often) {
    what = std::regex_replace(what, too_often, " is given $1 times; give it once");
  } else if (command.get_require_subcommand_min() > 0 && unknown.empty()) {
    what = "a command is missing";
  } else if (!unknown.empty()) {
    const std::string word = unknown.front().substr(0, unknown.front().find('='));
    what = "\"" + unknown.front() + "\" is no command or option of `" + FullName(command) + "`" +
           weft::DidYouMean(word, NamesIn(command));
  }
  what = weft::WithoutHugeNumbers(what);
  std::fprintf(stderr, "weft: error: %s\nRun `%s --help` for commands, options and examples.\n",
               weft::MessageText(what).c_str(), FullName(command).c_str());
  return weft::kExitBadInput;
}

// As a daemon runs commands. False where that has ended already, or this process cannot be confined.
bool BeWatchedBy(int parent, const std::vector<std::string>& readable, int64_t memory_mib) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  weft::PrintProgressAsLines();
  // Whoever records goes first.
  constexpr int kNiceness = 10;
  [[maybe_unused]] const int ignored = nice(kNiceness);
  if (getppid() != parent) return false;
  absl::Status confined = weft::ConfineProcess({.readable = readable,
                                                .writable = {std::filesystem::current_path().string()},
                                                .links = {},
                                                .may_run_programs = true});  // ffmpeg
  confined.Update(weft::LimitMemory(memory_mib));
  if (!confined.ok()) weft::PrintError(confined);
  return confined.ok();
}

// The command's exit status.
int RunToStatus(const weft::CommandLine& line, int64_t memory_mib) {
  try {
    const absl::Status status = line.run();
    if (!status.ok() && !weft::IsVerdict(status))
      weft::PrintError(status);  // a verdict stands printed already
    return weft::ExitStatusOf(status);
  } catch (const std::bad_alloc&) {
    weft::PrintError(absl::ResourceExhaustedError(absl::StrCat(
        "out of memory", memory_mib > 0 ? absl::StrCat("; an operation of this daemon may take ", memory_mib,
                                                       " MiB, --worker-memory-mib -1 of weftd sets no limit")
                                        : "")));
  } catch (const std::exception& error) {
    weft::PrintError(weft::IsLackOfThreads(error) ? weft::NoFurtherThreads()
                                                  : absl::InternalError(error.what()));
  }
  return weft::kExitFailed;
}

// In the order of the help.
void AddAllCommands(CLI::App& app, weft::CommandLine& line) {
  weft::AddRegisterCommand(app, line);
  weft::AddKindCommands(app, line);
  weft::AddJobCommand(app, line);
  weft::AddLibraryCommand(app, line);
  weft::AddCameraCommand(app, line);
  weft::AddDaemonCommand(app, line);
  weft::AddDoctorCommand(app, line);
  weft::AddSessionCommand(app, line);
  weft::AddSupportCommand(app, line);
  weft::AddTakeCommand(app, line);
  weft::AddOperationCommand(app, line);
  weft::AddAccessCommand(app, line);
  weft::AddRigCommand(app, line);
  weft::AddPatternCommand(app, line);
  weft::AddTemplateCommand(app, line);
  weft::AddGarmentCommand(app, line);
  weft::AddDecodeCommand(app, line);
  weft::AddAlignCommand(app, line);
  weft::AddOptionsCommand(app, line);
  weft::AddSimulateCommand(app, line);
  weft::AddAvatarCommand(app, line);
  weft::AddBodyCommand(app, line);
  weft::AddSplitCommand(app, line);
  weft::AddMotionCommand(app, line);
  weft::AddDatasetCommand(app, line);
  weft::AddEvaluateCommand(app, line);
  weft::AddExportCommand(app, line);
  weft::AddCompletionCommand(app, line);
}

}  // namespace

int main(int argc, char** argv) {
  weft::FailBeyondFileSize();
  weft::KeepFreedMemory();
  CLI::App app(
      "Weft captures cloth: decode a printed board in every view, triangulate it, register the garment.",
      "weft");
  weft::CommandLine line;
  app.set_version_flag("--version", "weft " WEFT_VERSION, "Print the version and exit");
  app.add_flag("-q,--quiet", line.quiet, "No progress bars and notes, only results and errors");
  int watched_by = 0;
  app.add_option("--watched-by", watched_by, "End with this process, and print progress as lines for it")
      ->group("");
  std::vector<std::string> readable;
  app.add_option("--may-read", readable, "What may be read then; written is below the current folder alone")
      ->expected(1)
      ->take_all()
      ->group("");
  int64_t memory_mib = 0;
  app.add_option("--memory-mib", memory_mib, "Memory that this process may take then; 0: any")->group("");
  app.require_subcommand(1);
  app.fallthrough();
  app.formatter(weft::MakeHelpFormatter());
  app.footer(
      "Exit status: 0 done, 1 failed or a verdict that is bad, 2 bad arguments or input.\n"
      "`weft COMMAND --help` explains a command and shows examples.");

  AddAllCommands(app, line);

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return ParseFailure(app, error);
  }
  absl::Status status = weft::CheckFinite(NamedCommand(app));
  if (watched_by == 0 && (!readable.empty() || memory_mib != 0))
    status.Update(absl::InvalidArgumentError("--may-read and --memory-mib are a daemon's; leave them out"));
  if (!line.writes_remotely) status.Update(weft::CheckOut(NamedCommand(app), line.quiet));
  if (!status.ok()) {
    weft::PrintError(status);
    return weft::ExitStatusOf(status);
  }
  if (watched_by != 0 && !BeWatchedBy(watched_by, readable, memory_mib)) return weft::kExitFailed;
  const auto run = [&line, memory_mib] { return RunToStatus(line, memory_mib); };
  return line.confined && watched_by == 0 ? weft::RunConfinedProcess(*line.confined, run) : run();
}
