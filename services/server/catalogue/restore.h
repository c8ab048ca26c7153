// Opens the catalogue as its jobs' records say. A damaged, emptied or missing file, or one of an older Weft,
// is set aside, never deleted, and a new one is made from the records.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "services/server/catalogue/job_records.h"
#include "services/server/catalogue/sqlite.h"

namespace weft {

struct RestoredCatalogue {
  std::unique_ptr<Database> database;
  std::vector<std::string> warnings;  // what a user must know of the restoration
};

// The caller holds the catalogue's FileLock. Jobs that one of rows and records lacks, or knows in an earlier
// state, get what the other says. A crash in the middle is made good by the next call. FailedPrecondition:
// written by a newer Weft, or in use by one that knows no FileLock. Otherwise errors of the disk.
absl::StatusOr<RestoredCatalogue> OpenRestored(const std::string& path, const JobRecords& records);

}  // namespace weft
