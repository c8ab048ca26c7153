// `weft export`: a job's result as files for other programs.
#pragma once

#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "services/results/export/export_request.h"
#include "weft/v1/export.pb.h"

namespace weft {

struct ExportOutcome {
  v1::Export manifest;  // as in <out>/export.json
  bool was_complete = false;
  std::vector<std::string> warnings = {};  // what the manifest does not tell
};

// Writes <out>/<frame>.<format> or <out>/garment.<format>, and export.json last. What is not complete stands
// in <out>/.unfinished/ or under a temporary name; the same request goes on with it. Memory: a few meshes.
// Everything is checked before the first byte is written. FailedPrecondition: the job has not ended, no frame
// has a mesh, or `out` holds another export. ResourceExhausted: the disk is too small, with what is needed
// and what is free. Cancelled: a stop was requested. Otherwise errors of ExportSource and of writing
// files, and where a texture is asked for those of MakeSequenceTexture.
absl::StatusOr<ExportOutcome> ExportResult(const ExportRequest& request, const ExportProgress& progress,
                                           const std::stop_token& stop);

}  // namespace weft
