// Files of a job's results, for clients.
#pragma once

#include "absl/status/statusor.h"
#include "services/server/daemon/calls/file_stream.h"
#include "weft/v1/jobs.pb.h"

namespace weft {

// Opens the file, whatever is exchanged for links meanwhile. The request passes CheckFetchRequest, and its
// frame must be one of the job's. NotFound: it does not exist (yet). PermissionDenied: a link, or no file;
// nothing in the job's folder leads out of it. InvalidArgument: no such mesh, with the names that there are.
// Otherwise errors of FilePieces::Open.
absl::StatusOr<FilePieces> OpenResult(const v1::Job& job, const v1::FetchResultRequest& request);

}  // namespace weft
