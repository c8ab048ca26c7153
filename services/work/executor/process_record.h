// Which processes a daemon has started, in files that outlive it: the next one waits for their end. No lock
// that they would inherit: whoever took such a process over could let go of it.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace weft {

// <folder>/<number> stands as long as this lives. It says which process of that number is meant.
class ProcessRecord {
 public:
  ProcessRecord() = default;
  // For a process that has not been reaped. Errors of WriteError.
  static absl::StatusOr<ProcessRecord> Make(const std::string& folder, pid_t pid);
  ProcessRecord(ProcessRecord&& other) noexcept;
  ProcessRecord& operator=(ProcessRecord&& other) noexcept;
  ~ProcessRecord();

 private:
  std::string path_;  // empty: none
};

// The recorded processes that run. Records of others are removed: those that have ended, also where their
// number was given again, those of an earlier boot, and those of another container, with which they ended.
std::vector<pid_t> FindRecorded(const std::string& folder);

}  // namespace weft
