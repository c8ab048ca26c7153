// What can still be read of a catalogue, row by row, whatever happened to the file.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/server/catalogue/sqlite.h"
#include "weft/v1/job.pb.h"

namespace weft {

struct StoredFrame {
  std::string name;                   // "" when it cannot be read
  std::optional<v1::FrameInfo> info;  // none: damaged
};

struct StoredJob {
  int64_t sequence = 0;
  std::optional<v1::Job> job;             // none: damaged, or known by its frames alone
  std::map<int64_t, StoredFrame> frames;  // by position
};

struct StoredCatalogue {
  std::map<std::string, StoredJob> jobs;  // by id
  // Why it is not whole, "" for a whole one.
  std::string damage;
};

// Reads all rows that can be read. Damaged pages are passed over: from the front up to them, from the back,
// and what lies between by its key.
StoredCatalogue ReadStored(Database& database, int64_t version);

// ReadStored of a damaged file together with its log, on a copy at `scratch`, which is removed again. A file
// whose first page (SQLite's header and the tables' places) is gone gets that of a new catalogue.
// ResourceExhausted: no room for the copy. A file of which nothing can be read is an empty StoredCatalogue.
absl::StatusOr<StoredCatalogue> SalvageFile(const std::string& path, const std::string& scratch);

// Adds what `other` has and `stored` lacks: jobs, damaged rows, and states that are further along. Returns
// how many jobs came wholly from `other`.
int Complete(StoredCatalogue& stored, const StoredCatalogue& other);

// Does `other` hold a job or a state that Complete would take over?
bool IsBehind(const StoredCatalogue& stored, const StoredCatalogue& other);

// The jobs as they go into a new catalogue, the oldest first. Damaged rows that nobody had become entries
// that say so
// (`remedy` ends their message); frames of a job that has not ended wait again.
struct RestoredJob {
  v1::Job job;
  std::vector<std::pair<int64_t, v1::FrameInfo>> frames;  // position and state
};
std::vector<RestoredJob> RestoreJobs(const StoredCatalogue& stored, const std::string& remedy);

}  // namespace weft
