// `weftd`: the daemon.
#include <CLI/CLI.hpp>

#include <grpc/support/log.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <cstdio>
#include <filesystem>
#include <memory>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "capture/file/plain_text.h"
#include "services/ground/process/command_option.h"
#include "services/ground/process/exit_status.h"
#include "services/ground/process/help.h"
#include "services/ground/process/process_limits.h"
#include "services/ground/process/program_beside.h"
#include "services/server/daemon/program/config_file.h"
#include "services/server/daemon/program/daemon.h"
#include "services/server/daemon/program/daemon_life.h"

namespace {

// Of an installation, or of a build tree. Empty: it was built without them.
std::string ConsoleFiles() {
  for (const char* place : {"../share/weft/console", "../console/dist"}) {
    const std::filesystem::path folder = std::filesystem::path(weft::ProgramBeside(place)).lexically_normal();
    if (weft::PathExists(folder / "index.html")) return folder.string();
  }
  return "";
}

void AddTlsOptions(CLI::App& app, weft::TlsFiles& tls) {
  weft::AddOption(app, "--tls-cert FILE", tls.certificate, "Certificate of the daemon, with its chain, PEM");
  weft::AddOption(app, "--tls-key FILE", tls.key, "Its key, PEM, closed to other users");
  weft::AddOption(app, "--tls-client-ca FILE", tls.client_authority,
                  "Certificates of the authority that vouches for clients, PEM. Clients may then show a "
                  "certificate instead of a token; `weft access certificate` gives its owner a role");
  weft::AddOption(app, "--tls-client-crl FILE", tls.client_revocations,
                  "The authority's list of revoked certificates, PEM");
}

void AddNoticeOptions(CLI::App& app, weft::NoticeOptions& notices) {
  weft::AddOption(app, "--on-end-command FILE", notices.program,
                  "Program to run when a take or a job has ended, without a shell; its standard input has "
                  "the notice as JSON (weft.v1.EndNotice)");
  weft::AddOption(app, "--on-end-timeout-s S", notices.program_timeout_s,
                  "The program is ended after so long", CLI::Range(1.0, 86400.0));
  weft::AddOption(app, "--on-end-url URL", notices.server.url,
                  "Where to post the same notice, by https, or by http on this machine; repeated until the "
                  "answer is 2xx, or for --keep-notices-days");
  weft::AddOption(app, "--on-end-secret FILE", notices.server.secret_file,
                  "File of a secret, closed to other users, which signs the posts: the header "
                  "X-Weft-Signature is \"sha256=\" and the HMAC-SHA256 of the body in hex");
  weft::AddOption(app, "--on-end-ca FILE", notices.server.authority,
                  "Certificates that vouch for the server, PEM; those of this machine where it is left out");
}

void AddSlurmOptions(CLI::App& app, weft::SlurmOptions& slurm) {
  weft::AddOption(app, "--slurm-folder DIR", slurm.folder,
                  "Run tasks on a cluster by Slurm instead of on this machine. A folder for their files and "
                  "logs, of this daemon alone, which the nodes see, too");
  weft::AddOption(app, "--slurm-tasks N", slurm.tasks, "Tasks that may run at once; 0: as many as Slurm lets",
                  CLI::Range(0, 100'000));
  weft::AddOption(app, "--slurm-frames-per-task N", slurm.frames_per_task,
                  "Frames of a task; `weft job plan` recommends a number", CLI::Range(1, 100'000));
  weft::AddOption(app, "--slurm-cpus-per-task N", slurm.cpus_per_task, "Cores of a task, one thread each",
                  CLI::Range(1, 1024));
  weft::AddOption(app, "--slurm-memory-mib MIB", slurm.memory_mib,
                  "Memory of a task; 0: 4096 at first, then half as much again as the largest one took",
                  CLI::Range(int64_t{0}, int64_t{1} << 30));
  weft::AddOption(app, "--slurm-time-limit-min MIN", slurm.time_limit_min,
                  "Time limit of a task; 0: that of its partition", CLI::Range(0, 365 * 24 * 60));
  weft::AddOption(app, "--slurm-partition NAME", slurm.partition,
                  "Partition; that of the cluster where it is left out");
  weft::AddOption(app, "--slurm-account NAME", slurm.account, "Account");
  weft::AddOption(app, "--slurm-qos NAME", slurm.qos, "Quality of service");
  weft::AddOption(app, "--slurm-option OPTION", slurm.extra,
                  "Further option of sbatch, with its value in one word; may be given several times");
  weft::AddOption(app, "--slurm-worker FILE", slurm.worker_program,
                  "The worker's program as nodes see it; --worker where it is left out");
  weft::AddOption(app, "--slurm-setup FILE", slurm.setup_file,
                  "Lines of shell that run on the node before the worker, for example `module load`");
  weft::AddOption(app, "--slurm-map-path PATHS", slurm.mapped_paths,
                  "HERE=THERE: nodes see the folder HERE as THERE; may be given several times");
  weft::AddOption(app, "--slurm-scratch DIR", slurm.scratch_folder,
                  "Folder on a disk of each node, for copies of the images that a task reads. Without it, "
                  "images are read from where they lie");
  weft::AddOption(app, "--slurm-scratch-mib MIB", slurm.scratch_mib,
                  "Quota of a task in the folder of --slurm-scratch; two frames at least should fit",
                  CLI::Range(int64_t{1}, int64_t{1} << 30));
  weft::AddOption(app, "--slurm-lag-s S", slurm.lag_s,
                  "How late nodes and this machine may see each other's files in --slurm-folder",
                  CLI::Range(0.0, 3600.0));
  weft::AddOption(app, "--slurm-query-s S", slurm.query_s,
                  "How long a task may be silent before Slurm is asked about it, and between two such "
                  "questions. A controller that serves few jobs bears 1",
                  CLI::Range(0.1, 3600.0));
}

void AddConsoleOptions(CLI::App& app, weft::DaemonOptions& options) {
  weft::AddOption(app, "--console HOST:PORT", options.console_listen,
                  "Serve the console at http://HOST:PORT/, or https where other machines reach it. Whoever "
                  "opens it shows a token once");
  weft::AddOption(app, "--console-host NAME", options.console_hosts,
                  "Name of this machine that browsers may ask for, besides its host name and addresses; may "
                  "be given several times");
  weft::AddOption(app, "--console-files DIR", options.console_files,
                  "Folder of the console's built pages; those installed unless given, none where empty");
}

// Days are those that a daemon has seen.
void AddRetentionOptions(CLI::App& app, weft::v1::RetentionRules& rules) {
  const auto add = [&](const std::string& name, const char* unit, const char* what) {
    const std::string field_name = absl::StrReplaceAll(name.substr(2), {{"-", "_"}});
    const auto* field = rules.GetDescriptor()->FindFieldByName(field_name);
    const auto set = [&rules, field](double value) {
      rules.GetReflection()->SetDouble(&rules, field, value);
    };
    // CLI::Range takes what is no number.
    app.add_option_function<double>(name, set, what)
        ->default_str(absl::StrCat(rules.GetReflection()->GetDouble(rules, field)))
        ->type_name(unit)
        ->check([](const std::string& text) {
          double number = -1;
          const bool is_right = absl::SimpleAtod(text, &number) && number >= 0 && number <= weft::kMostRule;
          return is_right ? std::string() : absl::StrCat("Value ", text, " is out of range; give 0 to 1e9");
        });
  };
  add("--keep-takes-days", "DAYS",
      "Takes that are older go to the trash, unless they are pinned; 0 keeps them. Days in which no daemon "
      "ran make nothing older, nor does a clock that jumps; `weft daemon retention --dry-run` rehearses");
  add("--keep-trash-days", "DAYS",
      "Takes are in the trash for so long before they are removed for good; ended operations are kept as "
      "long");
  add("--takes-quota-gib", "GIB",
      "Beyond this the oldest takes go, the trash first, unless they are pinned; 0 sets no limit");
  add("--least-free-gib", "GIB",
      "The same when takes leave less of the disk free. What others write costs no take, and uploads are "
      "refused below it; 0 removes nothing for its sake");
  add("--least-trash-hours", "HOURS", "Takes stay in the trash for so long however little room there is");
  add("--keep-jobs-days", "DAYS",
      "Jobs that ended longer ago are forgotten, with results in the state folder; results that lie "
      "elsewhere stay; 0 keeps all");
  add("--keep-uploads-days", "DAYS", "Uploads to which nothing came for so long are removed");
  add("--keep-notices-days", "DAYS", "Notices that nobody took for so long are given up");
}

void AddOptions(CLI::App& app, weft::DaemonOptions& options, std::string& log_level) {
  app.option_defaults()->always_capture_default();
  weft::AddOption(app, "--listen ADDRESS", options.listen,
                  "unix:PATH or HOST:PORT to listen on; port 0 takes a free one; may be given several times. "
                  "The default is unix:STATE/weftd.sock. The daemon's user and root may do everything there "
                  "and on loopback; all others need a token or a certificate (`weft access`). Beyond this "
                  "machine it needs --tls-cert and --tls-key");
  AddTlsOptions(app, options.tls);
  weft::AddOption(app, "--metrics HOST:PORT", options.metrics_listen,
                  "Serve metrics for Prometheus at http://HOST:PORT/metrics, or https where other machines "
                  "reach it. Whoever asks shows a token of the role viewer");
  AddConsoleOptions(app, options);
  weft::AddOption(app, "--state DIR", options.state_folder,
                  "Folder for the list of jobs, and for results whose folder is not shared; must be given");
  weft::AddOption(
      app, "--allow-path DIR", options.allow_paths,
      "Folder that jobs may read from and write to; may be given several times, must be given once");
  weft::AddOption(app, "--workers N", options.workers, "Worker processes; 0 chooses by the number of cores",
                  CLI::Range(0, 1024));
  weft::AddOption(app, "--threads-per-worker T", options.threads_per_worker,
                  "Threads of each worker; 0 chooses by the number of cores", CLI::Range(0, 1024));
  weft::AddOption(
      app, "--worker-memory-mib MIB", options.worker_memory_mib,
      "Memory of each worker, beyond which its frame fails; 0 shares the machine's among the workers, 4096 "
      "at the least; -1 sets no limit. Commands of operations have half the machine's",
      CLI::Range(int64_t{-1}, int64_t{1} << 30));
  weft::AddOption(app, "--worker FILE", options.worker_program, "The worker's program");
  weft::AddOption(app, "--worker-user NAME", options.worker_user,
                  "User whom the workers run as; needs a daemon that root started");
  AddSlurmOptions(app, options.slurm);
  weft::AddOption(app, "--recorder FILE", options.recorder_program, "The recorder's program");
  weft::AddOption(app, "--command FILE", options.command_program, "The program `weft`, for operations");
  AddRetentionOptions(app, options.retention);
  AddNoticeOptions(app, options.notices);
  weft::AddOption(app, "--address-file FILE", options.address_file,
                  "Write the addresses here once the daemon listens, a line each");
  weft::AddOption(app, "--log-level LEVEL", log_level, "How much to log, on standard error",
                  CLI::IsMember({"debug", "info", "warn", "error"}));
}

// What gRPC has to say about its inner life goes into our log.
void LogGrpc(gpr_log_func_args* args) {
  const auto level = args->severity == GPR_LOG_SEVERITY_ERROR ? spdlog::level::warn : spdlog::level::debug;
  spdlog::log(level, "grpc: {}", args->message);
}

// The text of a message on one line, whatever it quotes.
class PlainMessage : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&, spdlog::memory_buf_t& out) override {
    const std::string text =
        weft::EscapedText(weft::MessageText({message.payload.data(), message.payload.size()}));
    out.append(text.data(), text.data() + text.size());
  }
  std::unique_ptr<custom_flag_formatter> clone() const override { return std::make_unique<PlainMessage>(); }
};

void BeginLog() {
  spdlog::set_default_logger(spdlog::stderr_color_mt("weftd"));
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  formatter->add_flag<PlainMessage>('*').set_pattern("%Y-%m-%dT%H:%M:%S.%e%z %^%l%$ %*");
  spdlog::set_formatter(std::move(formatter));
}

int Fail(const absl::Status& status) {
  spdlog::error("{}", std::string(status.message()));
  return weft::ExitStatusOf(status);
}

// The options, and what was given for them.
struct Program {
  Program();

  CLI::App app;
  weft::DaemonSetup setup;
  bool prints_config = false;
};

Program::Program()
    : app("Keeps a queue of registration jobs and runs them in worker processes. `weft register --server` "
          "submits, `weft job` shows. May be stopped or killed at any time: it resumes its jobs at the next "
          "start.",
          "weftd") {
  app.formatter(weft::MakeHelpFormatter());
  app.footer(
      "Examples:\n  weftd --listen 127.0.0.1:7411 --state /var/lib/weft --allow-path /data\n"
      "  weftd --config /etc/weft/weftd.txtpb");
  app.set_version_flag("--version", "weftd " WEFT_VERSION, "Print the version and exit");
  weft::DaemonOptions& options = setup.options;
  options.worker_program = weft::ProgramBeside("weft-worker");
  options.recorder_program = weft::ProgramBeside("weft-recorder");
  options.command_program = weft::ProgramBeside("weft");
  options.reads_in_processes = true;
  weft::AddOption(app, "--config FILE", setup.config_file,
                  "Read options from here that no argument gives; SIGHUP reads it again");
  app.add_flag("--print-config", prints_config, "Print all options as a file for --config, and exit");
  AddOptions(app, options, setup.log_level);
}

absl::Status ReadConfig(Program& program) {
  if (!program.setup.config_file.empty()) {
    WEFT_RETURN_IF_ERROR(weft::ApplyConfigFile(program.setup.config_file, program.app));
  }
  program.setup.settings = weft::SettingsOf(program.app);
  if (program.app.count("--console-files") == 0) program.setup.options.console_files = ConsoleFiles();
  return absl::OkStatus();
}

// For arguments that were read before.
absl::StatusOr<weft::DaemonSetup> ReadAgain(int argc, char** argv) {
  Program program;
  try {
    program.app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return absl::InvalidArgumentError(error.what());
  }
  WEFT_RETURN_IF_ERROR(ReadConfig(program));
  WEFT_RETURN_IF_ERROR(program.setup.options.Validate());
  return program.setup;
}

}  // namespace

int main(int argc, char** argv) {
  weft::FailBeyondFileSize();
  Program program;
  try {
    program.app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return program.app.exit(error) == 0 ? weft::kExitDone : weft::kExitBadInput;
  }
  BeginLog();
  if (const absl::Status status = ReadConfig(program); !status.ok()) return Fail(status);
  if (program.prints_config) {
    std::fputs(weft::ConfigFileText(program.app).c_str(), stdout);
    return weft::kExitDone;
  }
  spdlog::set_level(spdlog::level::from_str(program.setup.log_level));
  gpr_set_log_function(LogGrpc);
  try {
    const absl::Status status = weft::RunDaemon(program.setup, [=] { return ReadAgain(argc, argv); });
    return status.ok() ? weft::kExitDone : Fail(status);
  } catch (const std::exception& error) {
    return Fail(absl::InternalError(error.what()));
  }
}
