#include "services/server/access/audit_log.h"

#include <fcntl.h>
#include <google/protobuf/util/json_util.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "base/host_clock.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"

namespace weft {
namespace {

constexpr int kOlderFiles = 9;
constexpr std::chrono::seconds kGatherFor{1};
constexpr size_t kMostGathered = 1000;  // kinds of refusals
constexpr size_t kLongestMessage = 500;

std::string OlderFile(const std::string& path, int age) {
  return age == 0 ? path : absl::StrCat(path, ".", age);
}

}  // namespace

std::string AuditLogFile(const std::string& state_folder) { return absl::StrCat(state_folder, "/audit.log"); }

absl::StatusOr<std::unique_ptr<AuditLog>> AuditLog::Open(std::string path, Warn warn, int64_t largest_bytes) {
  std::unique_ptr<AuditLog> log(new AuditLog(std::move(path), std::move(warn), largest_bytes));
  {
    const MutexLock lock(log->mutex_);
    WEFT_RETURN_IF_ERROR(log->OpenFile());
  }
  return log;
}

AuditLog::~AuditLog() {
  const MutexLock lock(mutex_);
  WriteGathered(Time::max());
}

absl::Status AuditLog::OpenFile() {
  constexpr mode_t kOwnerOnly = 0600;
  file_ = UniqueFd(open(path_.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC | O_NOFOLLOW, kOwnerOnly));
  if (!file_.open()) return WriteError(path_, errno);
  bytes_ = lseek(file_.get(), 0, SEEK_END);
  char last = '\n';
  // A crash may have cut the last line.
  if (bytes_ > 0 && pread(file_.get(), &last, 1, bytes_ - 1) == 1 && last != '\n')
    bytes_ += WriteAll(file_.get(), "\n") == 0 ? 1 : 0;
  return absl::OkStatus();
}

void AuditLog::Rotate() {
  std::error_code ignored;
  for (int age = kOlderFiles - 1; age >= 0; --age)
    std::filesystem::rename(OlderFile(path_, age), OlderFile(path_, age + 1), ignored);
  if (absl::Status status = OpenFile(); !status.ok()) warn_(std::string(status.message()));
}

absl::Status AuditLog::Append(v1::AuditEntry entry) {
  if (entry.message().size() > kLongestMessage) entry.mutable_message()->resize(kLongestMessage);
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  std::string line;
  if (!google::protobuf::util::MessageToJsonString(entry, &line, options).ok())
    return absl::InternalError("an entry is not UTF-8 text");
  line += '\n';
  if (bytes_ + static_cast<int64_t>(line.size()) > largest_bytes_) Rotate();
  if (const int error = WriteAll(file_.get(), line); error != 0) return WriteError(path_, error);
  bytes_ += static_cast<int64_t>(line.size());
  return absl::OkStatus();
}

bool AuditLog::Write(const v1::AuditEntry& entry) {
  if (lost_ > 0) {
    v1::AuditEntry gap;
    gap.set_time(entry.time());
    gap.set_outcome("LOST");
    gap.set_message("entries that could not be written");
    gap.set_times(lost_);
    if (Append(std::move(gap)).ok()) lost_ = 0;
  }
  const absl::Status status = Append(entry);
  if (status.ok()) return true;
  if (lost_++ == 0)
    warn_(absl::StrCat("the audit log is not written: ", absl::string_view(status.message())));
  return false;
}

bool AuditLog::Record(v1::AuditEntry entry) {
  entry.set_time(UtcText());
  const MutexLock lock(mutex_);
  return Write(entry);
}

void AuditLog::WriteGathered(Time before) {
  std::erase_if(refused_, [&](const auto& known) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    const Gathered& gathered = known.second;
    if (gathered.since >= before) return false;
    if (gathered.entry.times() > 0) Write(gathered.entry);
    return true;
  });
}

bool AuditLog::Refused(v1::AuditEntry entry) {
  entry.set_time(UtcText());
  const MutexLock lock(mutex_);
  const Time now = std::chrono::steady_clock::now();
  WriteGathered(now - kGatherFor);
  const Kind kind{entry.caller(), entry.peer(), entry.method(), entry.outcome()};
  const auto known = refused_.find(kind);
  if (known == refused_.end()) {
    if (refused_.size() >= kMostGathered) WriteGathered(Time::max());
    Write(entry);
    refused_[kind].since = now;
    return true;
  }
  const int32_t times = known->second.entry.times() + std::max(1, entry.times());
  known->second.entry = std::move(entry);
  known->second.entry.set_times(times);
  return false;
}

absl::StatusOr<std::vector<v1::AuditEntry>> ReadAuditLog(const std::string& path, size_t most) {
  std::vector<v1::AuditEntry> entries;  // newest first
  for (int age = 0; age <= kOlderFiles && entries.size() < most; ++age) {
    const absl::StatusOr<std::string> text = ReadWholeFile(OlderFile(path, age));
    if (absl::IsNotFound(text.status())) break;
    if (!text.ok()) return text.status();
    const std::vector<absl::string_view> lines = absl::StrSplit(*text, '\n', absl::SkipEmpty());
    for (auto line = lines.rbegin(); line != lines.rend() && entries.size() < most; ++line) {
      v1::AuditEntry entry;
      if (ParseJson(std::string_view(line->data(), line->size()), path, entry).ok())
        entries.push_back(std::move(entry));
    }
  }
  std::ranges::reverse(entries);
  return entries;
}

}  // namespace weft
