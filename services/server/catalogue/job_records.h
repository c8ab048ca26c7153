// A file per job beside the catalogue: the job and its frames as it was submitted, retried or ended. From
// these files a catalogue is made anew.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/whole_file.h"
#include "weft/v1/jobs.pb.h"

namespace weft {

// Each file is written whole or not at all, and carries a checksum. Thread safety: one thread at a time.
class JobRecords {
 public:
  // <catalogue>.jobs/<job id>
  explicit JobRecords(const std::string& catalogue) : folder_(catalogue + ".jobs") {}

  // On the disk when it returns, or whenever the system writes it there: a row that is on the disk makes good
  // for a record that a power cut took. Errors of CreateFolders and WriteFileAtomically.
  absl::Status Write(v1::JobUpdate record, Flush flush = Flush::kToDisk) const;
  absl::Status Remove(const std::string& job_id) const;
  // NotFound. DataLoss: damaged.
  absl::StatusOr<v1::JobUpdate> Read(const std::string& job_id) const;
  // Of all files, also damaged ones.
  std::vector<std::string> JobIds() const;

  std::string PathOf(const std::string& job_id) const { return folder_ + "/" + job_id; }

 private:
  std::string folder_;
};

// 0: it has not ended. A later end is further.
int64_t EndOf(const v1::Job& job);

v1::JobUpdate RecordOf(const v1::Job& job, const std::vector<v1::FrameInfo>& frames);

}  // namespace weft
