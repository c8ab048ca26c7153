#include "capture/take/take_progress.h"

#include <fcntl.h>

#include "absl/strings/str_cat.h"
#include "capture/file/posix_file.h"
#include "capture/sync/ledger.h"
#include "capture/take/take_files.h"

namespace weft {

absl::StatusOr<TakeProgress> ReadTakeProgress(const std::string& folder) {
  const absl::StatusOr<PosixFile> file = PosixFile::Open(LedgerFile(folder), O_RDONLY);
  if (!file.ok()) return file.status();
  absl::StatusOr<std::string> text = file->ReadAll();
  if (!text.ok()) return text.status();
  // A line that is being written is left for the next time.
  text->resize(text->rfind('\n') + 1);
  TakeProgress progress;
  if (text->empty()) return progress;
  const absl::StatusOr<ParsedLedger> ledger = ParseLedger(*text);
  if (!ledger.ok()) {
    return absl::Status(ledger.status().code(), absl::StrCat(folder, ": ", ledger.status().message()));
  }
  for (const LedgerEntry& entry : ledger->entries) {
    if (entry.event == LedgerEvent::kEnd) progress.closed = true;
    if (entry.event == LedgerEvent::kRecorded) progress.sets.push_back({entry.first_set, entry.host_time_ns});
  }
  return progress;
}

}  // namespace weft
