#include "capture/take/take_progress.h"

#include <fcntl.h>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/file/posix_file.h"
#include "capture/take/take_files.h"

namespace weft {
namespace {

void AddTo(const std::vector<LedgerEntry>& entries, TakeProgress& progress) {
  for (const LedgerEntry& entry : entries) {
    if (entry.event == LedgerEvent::kEnd) progress.closed = true;
    if (entry.event == LedgerEvent::kRecorded)
      progress.sets.push_back({entry.first_set, entry.host_time_ns, entry.device_time_ns});
  }
}

}  // namespace

absl::StatusOr<TakeProgress> ReadTakeProgress(const std::string& folder) {
  WEFT_ASSIGN_OR_RETURN(const PosixFile file, PosixFile::Open(LedgerFile(folder), O_RDONLY));
  WEFT_ASSIGN_OR_RETURN(std::string text, file.ReadAll());
  // A line that is being written is left for the next time.
  text.resize(text.rfind('\n') + 1);
  TakeProgress progress;
  if (text.empty()) return progress;
  const absl::StatusOr<ParsedLedger> ledger = ParseLedger(text);
  if (!ledger.ok()) {
    return absl::Status(ledger.status().code(), absl::StrCat(folder, ": ", ledger.status().message()));
  }
  AddTo(ledger->entries, progress);
  return progress;
}

absl::StatusOr<LedgerReader::News> LedgerReader::ReadNew() {
  WEFT_ASSIGN_OR_RETURN(const PosixFile file, PosixFile::Open(LedgerFile(take_folder_), O_RDONLY));
  WEFT_ASSIGN_OR_RETURN(const uint64_t size_bytes, file.Size());
  News news;
  // A recorder whose disk failed writes its last lines anew, and a recovery cuts damaged ones off.
  for (const bool from_start : {offset_bytes_ == 0, true}) {
    news.from_start = from_start;
    if (from_start) {
      offset_bytes_ = 0;
      tail_ = LedgerTail();
    }
    if (size_bytes < offset_bytes_) continue;
    std::string text(size_bytes - offset_bytes_, '\0');
    WEFT_RETURN_IF_ERROR(file.ReadAt(text.data(), text.size(), offset_bytes_));
    text.resize(text.rfind('\n') + 1);  // a line that is being written is left for the next time
    const size_t damaged = tail_.damaged_lines();
    news.entries = tail_.Add(text);
    offset_bytes_ += text.size();
    if (from_start || tail_.damaged_lines() == damaged) break;
  }
  return news;
}

absl::StatusOr<const TakeProgress*> TakeFollower::Poll() {
  WEFT_ASSIGN_OR_RETURN(const LedgerReader::News news, ledger_.ReadNew());
  if (news.from_start) progress_ = {};
  AddTo(news.entries, progress_);
  return &progress_;
}

}  // namespace weft
