// The result of a joint template as results of its garments.
#pragma once

#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace weft {

struct SplitGarment {
  std::string id;
  std::string result;  // the folder that was written
  int frames = 0;      // with a mesh
};

// Called with frames written and all, over all garments.
using SplitProgress = std::function<void(int done, int all)>;

// Writes <out>/<garment> for each garment of the template: its template, and the frames as a job of it would
// have left them. Nodes keep their rows of the joint board. Reports count the garment's own cells and
// vertices; what is known of the whole frame alone, its views and times, is left out. job.json comes last. A
// folder that holds another job's result is refused (FailedPrecondition), one of the same job is written
// again. FailedPrecondition: the job has not ended, or its template is of one garment. Cancelled: a stop was
// requested.
absl::StatusOr<std::vector<SplitGarment>> SplitJob(const std::string& result, const std::string& out,
                                                   const SplitProgress& progress,
                                                   const std::stop_token& stop);

}  // namespace weft
