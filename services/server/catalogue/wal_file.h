// Checks SQLite's write-ahead log (<database>-wal, https://sqlite.org/fileformat2.html#walformat). SQLite
// itself takes a damaged page for the log's end and silently drops all later transactions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace weft {

struct WalFile {
  struct Page {
    uint32_t number = 0;     // in the database, from 1
    size_t offset = 0;       // of its content in `bytes`
    bool is_commit = false;  // the last one of a transaction
  };

  std::string bytes;
  size_t page_bytes = 0;
  // The pages of transactions that were written to the end, in the order of writing; without damaged ones.
  std::vector<Page> pages;
  // Synced transactions follow a damaged page. The end of the last transaction alone may be missing after a
  // power cut, and is no damage.
  bool damaged = false;
};

// A missing or empty log has no pages. Unavailable: cannot be read.
absl::StatusOr<WalFile> ReadWalFile(const std::string& path);

// Writes the pages to where they belong in the database, which nobody has open; makes the file where it is
// missing. Damaged pages stay as they were. Errors of the operating system.
absl::Status ApplyWal(const WalFile& wal, const std::string& database_path);

}  // namespace weft
