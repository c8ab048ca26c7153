#include "services/work/executor/process_record.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <optional>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "base/process_identity.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/ground/process/unique_fd.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

// Boot and space of process numbers, and when the process started in it. None: it has ended.
std::optional<std::string> NameOf(pid_t pid) {
  const int64_t start = StartOfProcess(pid);
  if (start <= 0) return std::nullopt;
  return absl::StrCat(BootId(), " ", PidNamespace(), " ", start);
}

}  // namespace

absl::StatusOr<ProcessRecord> ProcessRecord::Make(const std::string& folder, pid_t pid) {
  WEFT_RETURN_IF_ERROR(CreateFolders(folder));
  ProcessRecord record;
  record.path_ = absl::StrCat(folder, "/", pid);
  // Not flushed: no process survives a power cut either.
  const UniqueFd file(open(record.path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600));
  if (!file.open()) return WriteError(record.path_, errno);
  if (const int error = WriteAll(file.get(), NameOf(pid).value_or("")))
    return WriteError(record.path_, error);
  return record;
}

ProcessRecord::ProcessRecord(ProcessRecord&& other) noexcept : path_(std::exchange(other.path_, "")) {}

ProcessRecord& ProcessRecord::operator=(ProcessRecord&& other) noexcept {
  std::swap(path_, other.path_);
  return *this;
}

ProcessRecord::~ProcessRecord() {
  if (!path_.empty()) unlink(path_.c_str());
}

std::vector<pid_t> FindRecorded(const std::string& folder) {
  std::vector<pid_t> running;
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored)) {
    pid_t pid = 0;
    const absl::StatusOr<std::string> recorded = ReadWholeFile(entry.path().string());
    if (absl::SimpleAtoi(entry.path().filename().string(), &pid) && recorded.ok() &&
        NameOf(pid) == *recorded) {
      running.push_back(pid);
    } else {
      fs::remove(entry.path(), ignored);
    }
  }
  return running;
}

}  // namespace weft
