#include "services/tools/installation/support_bundle.h"

#include <archive.h>
#include <archive_entry.h>
#include <sys/utsname.h>

#include <ctime>
#include <filesystem>
#include <map>
#include <memory>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/server/access/access_list.h"
#include "services/server/catalogue/job_records.h"
#include "services/studio/recording/doctor.h"
#include "services/tools/client/operation_client.h"
#include "services/tools/client/registration_client.h"
#include "services/tools/client/take_client.h"
#include "services/tools/installation/redaction.h"
#include "services/work/executor/run_program.h"
#include "weft/v1/sessions.pb.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr int kListed = 1000;

using Files = std::map<std::string, std::string>;  // by name

std::string TextOr(const absl::StatusOr<std::string>& text) {
  return text.ok() ? *text : absl::StrCat("not there: ", absl::string_view(text.status().message()), "\n");
}

std::string JsonOr(const absl::Status& status, const google::protobuf::Message& message) {
  return TextOr(status.ok() ? ToJson(message) : absl::StatusOr<std::string>(status));
}

template <typename Message>
std::string JsonOr(const absl::StatusOr<Message>& message) {
  return message.ok() ? JsonOr(absl::OkStatus(), *message) : JsonOr(message.status(), Message());
}

std::string Ran(const std::string& program, std::vector<std::string> arguments) {
  ProgramRun run;
  run.arguments = {program};
  run.arguments.insert(run.arguments.end(), arguments.begin(), arguments.end());
  return TextOr(RunProgram("/usr/bin/env", run));
}

class BundleContent {
 public:
  explicit BundleContent(const SupportOptions& options) : options_(options) {}

  Files Collect() {
    ReadConfigAndSecrets();
    files_["doctor.txt"] = DoctorReportText();
    AddVersions();
    AddMachine();
    AddDaemon();
    AddCatalogue();
    AddState();
    files_["journal.txt"] = Ran("journalctl", {"--unit=weftd", "--no-pager", "--output=short-iso",
                                               absl::StrCat("--lines=", options_.journal_lines)});
    Files redacted;
    for (auto& [name, text] : files_) redacted[name] = secrets_.Apply(std::move(text));
    return redacted;
  }

 private:
  const InstallationOptions& installation() const { return options_.installation; }

  void ReadConfigAndSecrets() {
    const std::string weftd = installation().program_folder + "/weftd";
    if (!installation().config_file.empty()) {
      files_["config.txtpb"] = TextOr(
          RunProgram(weftd, {.arguments = {"--config", installation().config_file, "--print-config"}}));
      const auto config = ReadDaemonConfig(installation().program_folder, installation().config_file);
      if (config.ok()) config_ = *config;
    }
    secrets_.AddSecretFile(config_.tls_key());
    secrets_.AddSecretFile(config_.on_end_secret());
    secrets_.AddSecretUrl(config_.on_end_url());
    for (const char* variable : {"WEFT_TOKEN_FILE", "WEFT_TLS_KEY"}) {
      if (const char* path = std::getenv(variable)) secrets_.AddSecretFile(path);
    }
    const auto list = ReadAccessList(AccessListFile(config_.state()));
    for (int i = 0; list.ok() && i < list->tokens_size(); ++i) secrets_.AddSecret(list->tokens(i).sha256());
    std::error_code ignored;
    for (const auto& entry : fs::directory_iterator(config_.state() + "/sessions", ignored)) {
      v1::CaptureSession session;
      if (ReadJsonFile(entry.path(), session).ok()) secrets_.AddSecret(session.lease());
    }
  }

  std::string DoctorReportText() const {
    DoctorOptions recording;
    recording.directory = config_.state().empty() ? "." : config_.state();
    recording.disk_test_gib = 0;
    recording.look_for_cameras = false;
    v1::DoctorReport report = Examine(recording);
    ExamineInstallation(installation(), report);
    AssessDoctorReport(report);
    return DoctorText(report);
  }

  void AddVersions() {
    std::string& text = files_["versions.txt"];
    for (const char* program : {"weft", "weftd", "weft-worker", "weft-recorder", "weft-video"}) {
      text += TextOr(RunProgram(absl::StrCat(installation().program_folder, "/", program),
                                {.arguments = {"--version"}}));
    }
    text += Ran("ffmpeg", {"-version"});
  }

  void AddMachine() {
    utsname name{};
    uname(&name);
    files_["machine.txt"] =
        absl::StrCat(name.sysname, " ", name.release, " ", name.version, " ", name.machine, "\n\n",
                     TextOr(ReadWholeFile("/etc/os-release", 1 << 16)), "\n", Ran("lscpu", {}), "\n",
                     Ran("free", {"-m"}), "\n", Ran("df", {"-h", "-x", "tmpfs", "-x", "overlay"}), "\n",
                     Ran("systemctl", {"status", "weftd", "--no-pager", "--lines=0"}));
  }

  void AddDaemon() {
    const std::string server =
        installation().server.empty() ? FirstAddressOf(config_) : installation().server;
    if (server.empty()) return;
    const auto client = RegistrationClient::Connect(server);
    if (!client.ok()) {
      files_["server.json"] = TextOr(client.status());
      return;
    }
    files_["server.json"] = JsonOr(absl::OkStatus(), (*client)->info());
    v1::ListJobsResponse jobs;
    const auto list = (*client)->List(kListed);
    if (list.ok()) jobs.mutable_jobs()->Assign(list->begin(), list->end());
    files_["jobs.json"] = JsonOr(list.status(), jobs);
    files_["takes.json"] = JsonOr(TakeClient(**client).List(kListed));
    files_["operations.json"] = JsonOr(OperationClient(**client).List(kListed));
  }

  // The records of its jobs, since the daemon has the catalogue for itself.
  void AddCatalogue() {
    if (config_.state().empty()) return;
    const std::string path = config_.state() + "/catalogue.sqlite";
    const JobRecords records(path);
    std::string& text = files_["catalogue.txt"];
    const std::vector<std::string> ids = records.JobIds();
    for (const std::string& id : ids) {
      const absl::Status read = records.Read(id).status();
      // One that was removed meanwhile is none.
      if (!read.ok() && !absl::IsNotFound(read))
        absl::StrAppend(&text, absl::string_view(read.message()), "\n");
    }
    if (text.empty()) text = absl::StrCat(path, ": ", ids.size(), " records of jobs, all whole\n");
  }

  // Names and sizes, of files that the daemon made.
  void AddState() {
    if (config_.state().empty()) return;
    constexpr int kDepth = 3;
    constexpr size_t kMostBytes = size_t{8} << 20;
    std::string& text = files_["state.txt"];
    std::error_code error;
    for (auto entry = fs::recursive_directory_iterator(config_.state(),
                                                       fs::directory_options::skip_permission_denied, error);
         !error && entry != fs::recursive_directory_iterator() && text.size() < kMostBytes;
         entry.increment(error)) {
      if (entry.depth() >= kDepth) entry.disable_recursion_pending();
      std::error_code unknown;
      const uintmax_t bytes = entry->is_regular_file(unknown) ? entry->file_size(unknown) : 0;
      const auto mode = static_cast<unsigned>(entry->symlink_status(unknown).permissions());
      absl::StrAppendFormat(&text, "%03o %14d  %s\n", mode & 0777, unknown ? 0 : bytes,
                            entry->path().lexically_relative(config_.state()).string());
    }
    if (error) absl::StrAppend(&text, "not there: ", error.message(), "\n");
  }

  const SupportOptions& options_;
  v1::DaemonConfig config_;
  Redaction secrets_;
  Files files_;
};

la_ssize_t AppendBytes(archive*, void* text, const void* bytes, size_t size) {
  static_cast<std::string*>(text)->append(static_cast<const char*>(bytes), size);
  return static_cast<la_ssize_t>(size);
}

absl::StatusOr<std::string> Pack(const Files& files, const std::string& folder, bool zstd) {
  std::string packed;
  const std::unique_ptr<archive, int (*)(archive*)> writer(archive_write_new(), archive_write_free);
  int result = archive_write_set_format_pax_restricted(writer.get());
  if (result == ARCHIVE_OK)
    result = zstd ? archive_write_add_filter_zstd(writer.get()) : archive_write_add_filter_gzip(writer.get());
  // Programs take no zeros behind the last compressed block.
  if (result == ARCHIVE_OK) result = archive_write_set_bytes_in_last_block(writer.get(), 1);
  if (result == ARCHIVE_OK) result = archive_write_open(writer.get(), &packed, nullptr, AppendBytes, nullptr);
  for (const auto& [name, text] : files) {
    if (result != ARCHIVE_OK) break;
    const std::unique_ptr<archive_entry, void (*)(archive_entry*)> entry(archive_entry_new(),
                                                                         archive_entry_free);
    archive_entry_set_pathname(entry.get(), absl::StrCat(folder, "/", name).c_str());
    archive_entry_set_size(entry.get(), static_cast<la_int64_t>(text.size()));
    archive_entry_set_filetype(entry.get(), AE_IFREG);
    archive_entry_set_perm(entry.get(), 0600);
    archive_entry_set_mtime(entry.get(), std::time(nullptr), 0);
    result = archive_write_header(writer.get(), entry.get());
    if (result == ARCHIVE_OK && archive_write_data(writer.get(), text.data(), text.size()) < 0)
      result = ARCHIVE_FATAL;
  }
  if (result == ARCHIVE_OK) result = archive_write_close(writer.get());
  if (result == ARCHIVE_OK) return packed;
  const char* why = archive_error_string(writer.get());
  return absl::InternalError(absl::StrCat("the bundle cannot be packed: ", why == nullptr ? "?" : why));
}

}  // namespace

absl::StatusOr<std::vector<std::string>> WriteSupportBundle(const SupportOptions& options) {
  const bool zstd = absl::EndsWith(options.out, ".tar.zst");
  if (!zstd && !absl::EndsWith(options.out, ".tar.gz"))
    return absl::InvalidArgumentError(
        absl::StrCat("--out: ", options.out, ": must end in .tar.zst or .tar.gz"));
  const Files files = BundleContent(options).Collect();
  WEFT_ASSIGN_OR_RETURN(const std::string packed, Pack(files, "weft-support", zstd));
  WEFT_RETURN_IF_ERROR(WriteFileAtomically(options.out, packed, 0600));
  std::vector<std::string> names;
  for (const auto& [name, text] : files) names.push_back(name);
  return names;
}

}  // namespace weft
