#include "services/tools/installation/installation_check.h"

#include <fcntl.h>
#include <google/protobuf/text_format.h>
#include <linux/landlock.h>
#include <linux/openat2.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "base/host_clock.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "services/ground/process/unique_fd.h"
#include "services/server/access/access_list.h"
#include "services/server/access/certificate_life.h"
#include "services/tools/client/registration_client.h"
#include "services/work/executor/run_program.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr double kWarnDays = 30;
constexpr int64_t kDay_s = 86400;
constexpr rlim_t kWantedDescriptors = 1300;
constexpr double kLowState_bytes = 10e9, kFullState_bytes = 1e9;
constexpr double kClockOff_s = 1;
constexpr double kNsPerS = 1e9;

class InstallationCheck {
 public:
  InstallationCheck(const InstallationOptions& options, v1::DoctorReport& report)
      : options_(options), report_(report) {}

  void Run() {
    CheckPrograms();
    CheckFfmpeg();
    CheckKernel();
    CheckDescriptors();
    ReadConfig();
    AskDaemon();
    if (!state_.empty()) CheckState();
    CheckCertificates();
    CheckTokens();
  }

 private:
  void Note(const std::string& subject, v1::DoctorVerdict verdict, const std::string& found,
            const std::string& remedy) {
    v1::DoctorFinding& finding = *report_.add_findings();
    finding.set_subject(subject);
    finding.set_verdict(verdict);
    finding.set_found(found);
    finding.set_remedy(remedy);
  }
  void Well(const std::string& subject, const std::string& found) {
    Note(subject, v1::DOCTOR_VERDICT_GOOD, found, "");
  }
  void Warn(const std::string& subject, const std::string& found, const std::string& remedy) {
    Note(subject, v1::DOCTOR_VERDICT_WARNING, found, remedy);
  }
  void Bad(const std::string& subject, const std::string& found, const std::string& remedy) {
    Note(subject, v1::DOCTOR_VERDICT_BAD, found, remedy);
  }

  void CheckPrograms();
  void CheckFfmpeg();
  void CheckKernel();
  void CheckDescriptors();
  void ReadConfig();
  void AskDaemon();
  void CheckDaemonInfo(const v1::ServerInfo& info, const std::string& server);
  void CheckState();
  void CheckCertificates();
  void CheckTokens();
  void NoteExpiry(const std::string& subject, int64_t ends_unix_s, const std::string& remedy);

  const InstallationOptions& options_;
  v1::DoctorReport& report_;
  v1::DaemonConfig config_;
  std::string state_;  // a folder of this machine; empty: unknown
};

void InstallationCheck::CheckPrograms() {
  for (const char* name : {"weftd", "weft-worker", "weft-recorder", "weft-video"}) {
    const std::string subject = absl::StrCat("program ", name), path = options_.program_folder + "/" + name;
    const absl::StatusOr<std::string> said = RunProgram(path, {.arguments = {"--version"}});
    const std::string wanted = absl::StrCat(name, " " WEFT_VERSION);
    if (!said.ok()) {
      Bad(subject, std::string(said.status().message()), "install the whole package again");
    } else if (absl::StripAsciiWhitespace(*said) != wanted) {
      Bad(subject,
          absl::StrCat(path, " is \"", absl::StripAsciiWhitespace(*said), "\", this is weft " WEFT_VERSION),
          "install all programs from one package, and restart the daemon");
    } else {
      Well(subject, wanted);
    }
  }
}

void InstallationCheck::CheckFfmpeg() {
  const char* path = std::getenv("PATH");
  for (const absl::string_view folder : absl::StrSplit(path == nullptr ? "" : path, ':', absl::SkipEmpty())) {
    const std::string program = absl::StrCat(folder, "/ffmpeg");
    if (access(program.c_str(), X_OK) == 0) return Well("ffmpeg", program);
  }
  Warn("ffmpeg", "is not installed: no archives and no videos", "`apt install ffmpeg`");
}

void InstallationCheck::CheckKernel() {
  open_how how{};
  how.flags = O_PATH | O_CLOEXEC;
  how.resolve = RESOLVE_BENEATH;
  const UniqueFd folder(static_cast<int>(syscall(SYS_openat2, AT_FDCWD, ".", &how, sizeof(how))));
  if (folder.open()) {
    Well("kernel openat2", "there");
  } else {
    Bad("kernel openat2", "missing: results cannot be kept within their folder",
        "Linux 5.6 or newer, and a container that allows the system call");
  }
  const long landlock =
      syscall(SYS_landlock_create_ruleset, nullptr, size_t{0}, LANDLOCK_CREATE_RULESET_VERSION);
  if (landlock > 0) {
    Well("kernel Landlock", absl::StrCat("version ", landlock));
  } else {
    Warn("kernel Landlock", "missing: workers are not confined by the kernel",
         "Linux 5.13 or newer with `lsm=...,landlock` on the kernel's command line");
  }
}

void InstallationCheck::CheckDescriptors() {
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  const std::string found = absl::StrCat("at most ", limit.rlim_max, " open files");
  if (limit.rlim_max >= kWantedDescriptors) return Well("descriptors", found);
  Warn("descriptors", found + ": a daemon that is started here takes fewer connections",
       "`ulimit -Hn 65536`, or LimitNOFILE of the service");
}

void InstallationCheck::ReadConfig() {
  if (options_.config_file.empty()) return;
  absl::StatusOr<v1::DaemonConfig> config = ReadDaemonConfig(options_.program_folder, options_.config_file);
  if (!config.ok()) {
    return Bad("configuration", std::string(config.status().message()),
               "mend it; a daemon that runs keeps its old settings until then");
  }
  config_ = *std::move(config);
  Well("configuration", options_.config_file);
  if (IsFolder(config_.state())) state_ = config_.state();
}

void InstallationCheck::AskDaemon() {
  const std::string server = options_.server.empty() ? FirstAddressOf(config_) : options_.server;
  if (server.empty()) return;
  const auto client = RegistrationClient::Connect(server);
  if (client.ok()) return CheckDaemonInfo((*client)->info(), server);
  const std::string message(client.status().message());
  if (absl::IsUnauthenticated(client.status())) {
    Warn("daemon", message, "name a token by WEFT_TOKEN_FILE, or look as the daemon's user");
  } else {
    Bad("daemon", message, "`systemctl status weftd` and `journalctl -u weftd` say why");
  }
}

void InstallationCheck::CheckDaemonInfo(const v1::ServerInfo& info, const std::string& server) {
  if (info.version() != WEFT_VERSION) {
    Bad("daemon", absl::StrCat("weftd at ", server, " is ", info.version(), ", this is weft " WEFT_VERSION),
        "`weft daemon drain`, then start the daemon again");
  } else {
    Well("daemon", absl::StrCat("weftd ", info.version(), " at ", server, ", ", info.jobs_running(),
                                " jobs run, ", info.jobs_queued(), " wait"));
  }
  for (const std::string& warning : info.warnings())
    Warn("daemon", warning, "see Troubleshooting in docs/guide/daemon-upkeep.md");
  const double off_s = static_cast<double>(info.unix_ns() - HostTime_ns()) / kNsPerS;
  if (std::abs(off_s) > kClockOff_s) {
    Warn("daemon's clock", absl::StrFormat("differs from this machine's by %.1f s", off_s),
         "run chrony on both machines");
  }
  if (state_.empty() && IsFolder(info.state_folder())) state_ = info.state_folder();
}

void InstallationCheck::CheckState() {
  const std::string subject = "state " + state_;
  struct stat folder = {};
  if (stat(state_.c_str(), &folder) != 0) return;
  if ((folder.st_mode & 077) != 0) {
    Bad(subject,
        absl::StrFormat("mode %03o: other users get at takes, results and leases", folder.st_mode & 0777),
        absl::StrCat("`chmod 700 ", state_, "`"));
  }
  std::error_code error;
  const fs::space_info space = fs::space(state_, error);
  if (error) return Warn(subject, error.message(), "look as the daemon's user");
  const auto free_bytes = static_cast<double>(space.available);
  const std::string found = absl::StrFormat("%.1f GB free", free_bytes / 1e9);
  if (free_bytes < kFullState_bytes) {
    Bad(subject, found + ": jobs wait and takes end", "make room, or set takes_quota_gib and least_free_gib");
  } else if (free_bytes < kLowState_bytes) {
    Warn(subject, found, "make room, or set takes_quota_gib and least_free_gib");
  } else {
    Well(subject, found);
  }
}

void InstallationCheck::NoteExpiry(const std::string& subject, int64_t ends_unix_s,
                                   const std::string& remedy) {
  const double days =
      (static_cast<double>(ends_unix_s) - static_cast<double>(HostTime_ns()) / kNsPerS) / kDay_s;
  if (days < 0) {
    Bad(subject, absl::StrFormat("expired %.0f days ago", std::ceil(-days)), remedy);
  } else if (days < kWarnDays) {
    Warn(subject, absl::StrFormat("expires in %.0f days", std::floor(days)), remedy);
  } else {
    Well(subject, absl::StrFormat("valid for %.0f days", std::floor(days)));
  }
}

void InstallationCheck::CheckCertificates() {
  for (const std::string* file : {&config_.tls_cert(), &config_.tls_client_ca(), &config_.tls_client_crl()}) {
    if (file->empty()) continue;
    const absl::StatusOr<std::vector<CertificateLife>> lives = LivesOfCertificates(*file);
    if (!lives.ok()) {
      Bad("certificate " + *file, std::string(lives.status().message()),
          "name a PEM file that weftd may read");
      continue;
    }
    for (const CertificateLife& life : *lives) {
      NoteExpiry(absl::StrCat("certificate ", life.subject), life.ends_unix_s,
                 absl::StrCat("renew it in ", *file, "; weftd takes it without a restart"));
    }
  }
}

void InstallationCheck::CheckTokens() {
  if (state_.empty() || access(AccessListFile(state_).c_str(), R_OK) != 0) return;
  const absl::StatusOr<v1::AccessList> list = ReadAccessList(AccessListFile(state_));
  if (!list.ok()) {
    return Bad("tokens", std::string(list.status().message()),
               "nobody is let in by token until it is mended");
  }
  for (const v1::Token& token : list->tokens()) {
    if (token.expires_unix_ns() == 0) continue;
    const int64_t ends_unix_s = token.expires_unix_ns() / 1'000'000'000;
    const bool has_expired = token.expires_unix_ns() < HostTime_ns();
    const std::string subject = absl::StrCat("token ", token.id(), " of ", token.name());
    if (has_expired) {
      Warn(subject, "has expired",
           absl::StrCat("`weft access revoke ", token.id(), " --state ", state_,
                        "`, and make another one if it is missed"));
    } else {
      NoteExpiry(subject, ends_unix_s,
                 absl::StrCat("`weft access token ", token.name(), "` makes the next one"));
    }
  }
}

}  // namespace

std::string OwnProgramFolder() {
  std::error_code error;
  return fs::read_symlink("/proc/self/exe", error).parent_path().string();
}

absl::StatusOr<v1::DaemonConfig> ReadDaemonConfig(const std::string& program_folder,
                                                  const std::string& config_file) {
  WEFT_ASSIGN_OR_RETURN(
      const std::string text,
      RunProgram(program_folder + "/weftd", {.arguments = {"--config", config_file, "--print-config"}}));
  v1::DaemonConfig config;
  if (google::protobuf::TextFormat::ParseFromString(text, &config)) return config;
  return absl::InternalError(
      absl::StrCat(config_file, ": weftd prints what weft does not read; are they of one version?"));
}

std::string FirstAddressOf(const v1::DaemonConfig& config) {
  if (!config.listen().empty()) return config.listen(0);
  return config.state().empty() ? "" : absl::StrCat("unix:", config.state(), "/weftd.sock");
}

void ExamineInstallation(const InstallationOptions& options, v1::DoctorReport& report) {
  InstallationCheck(options, report).Run();
}

}  // namespace weft
