#include "services/server/notice/end_notices.h"

#include <unistd.h>

#include <filesystem>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "base/host_clock.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/work/executor/run_program.h"

namespace weft {
namespace {

constexpr int kProgramsAtOnce = 2;
constexpr char kOfProgram[] = "command", kOfServer[] = "url";

std::string NameOfHost() {
  char name[256] = "";
  gethostname(name, sizeof(name) - 1);
  return name;
}

}  // namespace

absl::Status NoticeOptions::Validate() const {
  if (!program.empty()) {
    if (!std::filesystem::path(program).is_absolute())
      return absl::InvalidArgumentError(
          absl::StrCat("--on-end-command: ", program, ": must be an absolute path; no shell looks for it"));
    if (access(program.c_str(), X_OK) != 0 || std::filesystem::is_directory(program))
      return absl::NotFoundError(
          absl::StrCat("--on-end-command: ", program, ": no program that this user may run"));
  }
  return CheckNoticeServer(server);
}

absl::StatusOr<std::unique_ptr<EndNotices>> EndNotices::Open(const std::string& folder,
                                                             NoticeOptions options) {
  std::unique_ptr<EndNotices> notices(new EndNotices(std::move(options)));
  WEFT_RETURN_IF_ERROR(CreateFolders(folder));
  WEFT_RETURN_IF_ERROR(notices->ReadBeginning(folder + "/begun"));
  OutboxOptions of_programs;
  of_programs.folder = absl::StrCat(folder, "/", kOfProgram);
  of_programs.at_once = kProgramsAtOnce;
  WEFT_ASSIGN_OR_RETURN(
      notices->programs_,
      Outbox::Open(of_programs, [all = notices.get()](const std::string& path, const std::stop_token& stop) {
        const NoticeOptions now = all->Options();
        if (now.program.empty()) return absl::OkStatus();
        ProgramRun run;
        run.input = path;
        run.stop = stop;
        run.patience = std::chrono::duration_cast<std::chrono::milliseconds>(
            std::chrono::duration<double>(now.program_timeout_s));
        const absl::Status status = RunProgram(now.program, run).status();
        if (!absl::IsDeadlineExceeded(status)) return status;
        return absl::DeadlineExceededError(
            absl::StrCat(absl::string_view(status.message()), "; --on-end-timeout-s gives it more"));
      }));
  OutboxOptions of_requests;
  of_requests.folder = absl::StrCat(folder, "/", kOfServer);
  WEFT_ASSIGN_OR_RETURN(
      notices->requests_,
      Outbox::Open(of_requests, [all = notices.get()](const std::string& path, const std::stop_token& stop) {
        const NoticeOptions now = all->Options();
        return now.server.url.empty() ? absl::OkStatus() : PostNotice(now.server, path, stop);
      }));
  return notices;
}

absl::Status EndNotices::ReadBeginning(const std::string& path) {
  const absl::StatusOr<std::string> text = ReadWholeFile(path, 64);
  if (text.ok() && absl::SimpleAtoi(*text, &begun_unix_ns_)) return absl::OkStatus();
  begun_unix_ns_ = HostTime_ns();
  return WriteFileAtomically(path, absl::StrCat(begun_unix_ns_, "\n"), 0600);
}

NoticeOptions EndNotices::Options() {
  const MutexLock lock(mutex_);
  return options_;
}

std::vector<Outbox::Waits> EndNotices::Waiting() {
  std::vector<Outbox::Waits> all;
  for (const auto& [kind, box] :
       {std::pair(kOfProgram, programs_.get()), std::pair(kOfServer, requests_.get())}) {
    for (const Outbox::Waits& waits : box->Waiting())
      all.push_back({absl::StrCat(kind, "/", waits.name), waits.since_unix_ns});
  }
  return all;
}

absl::Status EndNotices::GiveUp(const std::string& name) {
  absl::string_view in_box = name;
  if (absl::ConsumePrefix(&in_box, absl::StrCat(kOfProgram, "/")))
    return programs_->GiveUp(std::string(in_box));
  if (absl::ConsumePrefix(&in_box, absl::StrCat(kOfServer, "/")))
    return requests_->GiveUp(std::string(in_box));
  return absl::NotFoundError(absl::StrCat("no notice ", name));
}

void EndNotices::SetOptions(NoticeOptions options) {
  const MutexLock lock(mutex_);
  options_ = std::move(options);
}

absl::Status EndNotices::JobEnded(const v1::Job& job) {
  v1::EndNotice notice;
  notice.set_ended_unix_ns(job.finished_unix_ns());
  *notice.mutable_job() = job;
  return Notify(std::move(notice), "job", job.id());
}

absl::Status EndNotices::TakeEnded(const v1::RecordedTake& take) {
  if (take.state().updated_unix_ns() < begun_unix_ns_) return absl::OkStatus();
  v1::EndNotice notice;
  notice.set_ended_unix_ns(take.state().updated_unix_ns());
  *notice.mutable_take() = take;
  return Notify(std::move(notice), "take", take.id());
}

absl::Status EndNotices::Notify(v1::EndNotice notice, const std::string& kind, const std::string& id) {
  const NoticeOptions now = Options();
  if (now.program.empty() && now.server.url.empty()) return absl::OkStatus();
  notice.set_id(absl::StrCat(notice.ended_unix_ns(), "-", kind, "-", id));
  notice.set_host(NameOfHost());
  notice.set_weft_version(WEFT_VERSION);
  WEFT_ASSIGN_OR_RETURN(const std::string text, ToJson(notice));
  if (!now.program.empty()) {
    WEFT_RETURN_IF_ERROR(programs_->Put(notice.id(), text));
  }
  return now.server.url.empty() ? absl::OkStatus() : requests_->Put(notice.id(), text);
}

}  // namespace weft
