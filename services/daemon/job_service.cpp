#include "services/daemon/job_service.h"

#include <algorithm>
#include <functional>

#include "absl/strings/str_cat.h"
#include "capture/file/plain_text.h"
#include "services/daemon/answer.h"
#include "services/daemon/request_check.h"
#include "services/daemon/results.h"
#include "services/daemon/watch_reactor.h"
#include "services/rpc/error_detail.h"

namespace weft {

absl::StatusOr<v1::Job> JobService::FindSubmitted(const v1::SubmitJobRequest& request) {
  const std::string& key = request.idempotency_key();
  if (key.empty()) return absl::NotFoundError("no key");
  absl::StatusOr<v1::Job> job = queue_.Get(key);
  if (!job.ok() || job->request_hash() == HashOfRequest(request)) return job;
  return FieldError(
      absl::StatusCode::kAlreadyExists,
      {"idempotency_key", absl::StrCat("job ", key, " was submitted with another spec or priority"),
       "choose a new key"});
}

absl::StatusOr<v1::Job> JobService::Submit(const v1::SubmitJobRequest& request, const std::string& caller) {
  // A repeated request waits here until the first one is queued.
  const auto lock = submitting_.Lock(request.idempotency_key());
  absl::StatusOr<v1::Job> submitted = FindSubmitted(request);
  if (!absl::IsNotFound(submitted.status())) return submitted;
  absl::StatusOr<PreparedJob> prepared =
      PrepareJob(request, {parts_.policy, parts_.library, parts_.results_folder, known_}, parts_.load);
  if (!prepared.ok()) return prepared.status();
  prepared->job.set_submitted_by(caller);
  const std::string id = prepared->job.id();
  if (absl::Status status = queue_.Submit(std::move(prepared->job), prepared->frames); !status.ok()) {
    return status;
  }
  return queue_.Get(id);
}

grpc::Status JobService::SubmitJob(grpc::ServerContext* context, const v1::SubmitJobRequest* request,
                                   v1::Job* job) {
  return Answer("SubmitJob", [&] { return Assign(Submit(*request, parts_.caller(*context)), job); });
}

grpc::Status JobService::GetJob(grpc::ServerContext*, const v1::GetJobRequest* request, v1::Job* job) {
  return Answer("GetJob", [&]() -> absl::Status {
    if (absl::Status status = CheckJobId(request->job_id()); !status.ok()) return status;
    return Assign(queue_.Get(request->job_id()), job);
  });
}

grpc::Status JobService::ListJobs(grpc::ServerContext*, const v1::ListJobsRequest* request,
                                  v1::ListJobsResponse* response) {
  return Answer("ListJobs", [&]() -> absl::Status {
    const absl::StatusOr<int> limit = LimitOf(request->limit());
    if (!limit.ok()) return limit.status();
    const absl::StatusOr<std::vector<v1::Job>> jobs = queue_.List(*limit);
    if (!jobs.ok()) return jobs.status();
    response->mutable_jobs()->Assign(jobs->begin(), jobs->end());
    for (const std::string& warning : queue_.Warnings()) response->add_warnings(EscapedText(warning));
    return absl::OkStatus();
  });
}

grpc::ServerWriteReactor<v1::JobUpdate>* JobService::WatchJob(grpc::CallbackServerContext* context,
                                                              const v1::WatchJobRequest* request) {
  return weft::WatchJob(context, queue_, request->job_id());
}

grpc::Status JobService::CancelJob(grpc::ServerContext*, const v1::CancelJobRequest* request, v1::Job* job) {
  return Answer("CancelJob", [&]() -> absl::Status {
    if (absl::Status status = CheckJobId(request->job_id()); !status.ok()) return status;
    return Assign(queue_.Cancel(request->job_id()), job);
  });
}

grpc::Status JobService::RetryJob(grpc::ServerContext*, const v1::RetryJobRequest* request, v1::Job* job) {
  return Answer("RetryJob", [&]() -> absl::Status {
    if (absl::Status status = CheckJobId(request->job_id()); !status.ok()) return status;
    return Assign(queue_.Retry(request->job_id()), job);
  });
}

grpc::Status JobService::SetJobPriority(grpc::ServerContext*, const v1::SetJobPriorityRequest* request,
                                        v1::Job* job) {
  return Answer("SetJobPriority", [&]() -> absl::Status {
    if (absl::Status status = CheckJobId(request->job_id()); !status.ok()) return status;
    if (absl::Status status = CheckPriority(request->priority()); !status.ok()) return status;
    return Assign(queue_.SetPriority(request->job_id(), request->priority()), job);
  });
}

grpc::Status JobService::ListFrames(grpc::ServerContext*, const v1::ListFramesRequest* request,
                                    v1::ListFramesResponse* response) {
  return Answer("ListFrames", [&]() -> absl::Status {
    if (absl::Status status = CheckJobId(request->job_id()); !status.ok()) return status;
    const absl::StatusOr<std::vector<v1::FrameInfo>> frames = queue_.Frames(request->job_id());
    if (!frames.ok()) return frames.status();
    response->mutable_frames()->Assign(frames->begin(), frames->end());
    return absl::OkStatus();
  });
}

absl::StatusOr<FilePieces> JobService::OpenResult(const v1::FetchResultRequest& request) {
  if (absl::Status status = CheckFetchRequest(request); !status.ok()) return status;
  const absl::StatusOr<v1::Job> job = queue_.Get(request.job_id());
  if (!job.ok()) return job.status();
  if (!request.frame().empty()) {
    const absl::StatusOr<std::vector<v1::FrameInfo>> frames = queue_.Frames(request.job_id());
    if (!frames.ok()) return frames.status();
    const bool known = std::any_of(frames->begin(), frames->end(), [&](const v1::FrameInfo& info) {
      return info.frame() == request.frame();
    });
    if (!known) {
      return absl::NotFoundError(
          absl::StrCat("job ", request.job_id(), " has no frame \"", request.frame(), "\""));
    }
  }
  return weft::OpenResult(*job, request.frame(), request.kind(), {request.offset(), request.version()});
}

grpc::ServerWriteReactor<v1::FileChunk>* JobService::FetchResult(grpc::CallbackServerContext* context,
                                                                 const v1::FetchResultRequest* request) {
  return SendFile(context, "FetchResult", [&] { return OpenResult(*request); });
}

}  // namespace weft
