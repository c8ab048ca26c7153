// From a request to a job that can be queued.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "services/server/daemon/calls/path_policy.h"
#include "services/server/daemon/calls/resolve_input.h"
#include "services/server/daemon/work/known_inputs.h"
#include "services/server/library/library.h"
#include "weft/v1/jobs.pb.h"

namespace weft {

struct PreparedJob {
  v1::Job job;
  std::vector<std::string> frames;
  // Items of the library that it reads. They are not deleted while these live; then the queue knows the job.
  std::vector<std::shared_ptr<const void>> holds;
};

// Where a job's files may lie.
struct JobPlaces {
  const PathPolicy& policy;
  Library& library;
  const ResolveInput& resolve;
  std::string results_folder;
  KnownInputs& known;
};

// Of what a request asks for. Another one where spec or priority differ.
std::string HashOfRequest(const v1::SubmitJobRequest& request);

// Checks the request, its paths and its inputs, assigns an id (its idempotency key, if it
// has one), and creates the folder of results. This is
// spec.out when the client's probe lies there or there is none, otherwise <results_folder>/<id>. NotFound: an
// item of the library is not there; field and name are named, and what there is.
absl::StatusOr<PreparedJob> PrepareJob(const v1::SubmitJobRequest& request, const JobPlaces& places,
                                       const std::string& caller_name, const InputsLoader& load);

}  // namespace weft
