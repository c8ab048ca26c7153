// Files of a job's results, for clients.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "weft/v1/jobs.pb.h"

namespace weft {

// Where the file lies. `frame` must be one of the job's. NotFound: it does not exist (yet). PermissionDenied:
// a link that leads out of the job's folder.
absl::StatusOr<std::string> FindResult(const v1::Job& job, const std::string& frame, v1::ResultKind kind);

// Where a transfer goes on: at `offset`, if the file still has `version` (FileChunk.version).
struct StreamStart {
  int64_t offset = 0;
  std::string version;  // not looked at where offset is 0
};

// Reads the file in pieces, all of the same version of it, until `write` returns false. Nothing to send is
// one empty piece. Aborted: another version stands there now. OutOfRange: it ends before the offset.
absl::Status StreamFile(const std::string& path, const StreamStart& start,
                        const std::function<bool(const v1::FileChunk&)>& write);

}  // namespace weft
