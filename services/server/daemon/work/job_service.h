// The service Jobs: requests checked, then handed to the queue.
#pragma once

#include <functional>
#include <string>

#include "services/server/daemon/calls/file_stream.h"
#include "services/server/daemon/calls/name_locks.h"
#include "services/server/daemon/calls/path_policy.h"
#include "services/server/daemon/door/call_identity.h"
#include "services/server/daemon/work/job_queue.h"
#include "services/server/daemon/work/known_inputs.h"
#include "services/server/daemon/work/prepare_job.h"
#include "services/server/library/library.h"
#include "weft/v1/jobs.grpc.pb.h"

namespace weft {

struct JobServiceParts {
  JobQueue& queue;
  Library& library;
  PathPolicy policy;
  ResolveInput resolve;
  std::string results_folder;
  InputsLoader load;
  FindCaller caller;
};

// Errors as jobs.proto says. Thread safety: gRPC calls from many threads.
class JobService final : public v1::Jobs::WithCallbackMethod_WatchJob<
                             v1::Jobs::WithCallbackMethod_FetchResult<v1::Jobs::Service>> {
 public:
  // Jobs whose results go nowhere else get <results_folder>/<id>. Queue and library must outlive the service.
  explicit JobService(JobServiceParts parts) : parts_(std::move(parts)), queue_(parts_.queue) {}

  grpc::Status SubmitJob(grpc::ServerContext* context, const v1::SubmitJobRequest* request,
                         v1::Job* job) override;
  grpc::Status GetJob(grpc::ServerContext* context, const v1::GetJobRequest* request, v1::Job* job) override;
  grpc::Status ListJobs(grpc::ServerContext* context, const v1::ListJobsRequest* request,
                        v1::ListJobsResponse* response) override;
  grpc::ServerWriteReactor<v1::JobUpdate>* WatchJob(grpc::CallbackServerContext* context,
                                                    const v1::WatchJobRequest* request) override;
  grpc::Status CancelJob(grpc::ServerContext* context, const v1::CancelJobRequest* request,
                         v1::Job* job) override;
  grpc::Status RetryJob(grpc::ServerContext* context, const v1::RetryJobRequest* request,
                        v1::Job* job) override;
  grpc::Status SetJobPriority(grpc::ServerContext* context, const v1::SetJobPriorityRequest* request,
                              v1::Job* job) override;
  grpc::Status ListWorkKinds(grpc::ServerContext* context, const v1::ListWorkKindsRequest* request,
                             v1::ListWorkKindsResponse* response) override;
  grpc::Status ListFrames(grpc::ServerContext* context, const v1::ListFramesRequest* request,
                          v1::ListFramesResponse* response) override;
  grpc::ServerWriteReactor<v1::FileChunk>* FetchResult(grpc::CallbackServerContext* context,
                                                       const v1::FetchResultRequest* request) override;

 private:
  absl::StatusOr<v1::Job> Submit(const v1::SubmitJobRequest& request, const Caller& caller);
  // The job of an earlier request with the same idempotency key. NotFound: there is none. AlreadyExists: that
  // request asked for something else, or somebody else made it.
  absl::StatusOr<v1::Job> FindSubmitted(const v1::SubmitJobRequest& request, const Caller& caller);
  // Whether the caller may change this job. NotFound; PermissionDenied.
  absl::Status CheckOwns(const std::string& job_id, const Caller& caller);
  absl::StatusOr<v1::Job> Retry(const std::string& job_id, const Caller& caller);
  absl::StatusOr<FilePieces> OpenResult(const v1::FetchResultRequest& request);

  const JobServiceParts parts_;
  JobQueue& queue_;
  NameLocks submitting_;  // by idempotency key
  KnownInputs known_;
};

}  // namespace weft
