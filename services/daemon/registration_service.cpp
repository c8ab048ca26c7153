#include "services/daemon/registration_service.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <exception>
#include <functional>

#include "absl/strings/str_cat.h"
#include "capture/file/plain_text.h"
#include "services/daemon/request_check.h"
#include "services/daemon/results.h"
#include "services/daemon/watch_reactor.h"
#include "services/rpc/grpc_status.h"

namespace weft {
namespace {

constexpr int kDefaultListLimit = 100;
constexpr int kMaxListLimit = 1000;

// Runs a handler; what is thrown ends the call, not the daemon.
grpc::Status Answer(const char* method, const std::function<absl::Status()>& handler) {
  absl::Status status;
  try {
    status = handler();
  } catch (const std::bad_alloc&) {
    status = absl::ResourceExhaustedError("the daemon is out of memory");
  } catch (const std::exception& error) {
    status = absl::InternalError(error.what());
  }
  if (!status.ok()) spdlog::info("{}: {}", method, EscapedText(status.ToString()));
  return ToGrpcStatus(status);
}

template <typename Message>
absl::Status Assign(absl::StatusOr<Message> result, Message* message) {
  if (result.ok()) *message = *std::move(result);
  return result.status();
}

}  // namespace

RegistrationService::RegistrationService(JobQueue& queue, PathPolicy policy, v1::ServerInfo info,
                                         InputsLoader load)
    : queue_(queue), policy_(std::move(policy)), info_(std::move(info)), load_(std::move(load)) {}

absl::StatusOr<v1::Job> RegistrationService::FindSubmitted(const v1::SubmitJobRequest& request) {
  const std::string& key = request.idempotency_key();
  if (key.empty()) return absl::NotFoundError("no key");
  absl::StatusOr<v1::Job> job = queue_.Get(key);
  if (!job.ok() || job->request_hash() == HashOfRequest(request)) return job;
  return absl::AlreadyExistsError(absl::StrCat(
      "idempotency_key: job ", key, " was submitted with another spec or priority; choose a new key"));
}

absl::StatusOr<v1::Job> RegistrationService::Submit(const v1::SubmitJobRequest& request) {
  // A repeated request waits here until the first one is queued.
  const std::lock_guard lock(submitting_);
  absl::StatusOr<v1::Job> submitted = FindSubmitted(request);
  if (!absl::IsNotFound(submitted.status())) return submitted;
  absl::StatusOr<PreparedJob> prepared =
      PrepareJob(request, policy_, absl::StrCat(info_.state_folder(), "/results"), load_);
  if (!prepared.ok()) return prepared.status();
  const std::string id = prepared->job.id();
  if (absl::Status status = queue_.Submit(std::move(prepared->job), prepared->frames); !status.ok()) {
    return status;
  }
  return queue_.Get(id);
}

grpc::Status RegistrationService::SubmitJob(grpc::ServerContext*, const v1::SubmitJobRequest* request,
                                            v1::Job* job) {
  return Answer("SubmitJob", [&] { return Assign(Submit(*request), job); });
}

grpc::Status RegistrationService::GetJob(grpc::ServerContext*, const v1::GetJobRequest* request,
                                         v1::Job* job) {
  return Answer("GetJob", [&]() -> absl::Status {
    if (absl::Status status = CheckJobId(request->job_id()); !status.ok()) return status;
    return Assign(queue_.Get(request->job_id()), job);
  });
}

grpc::Status RegistrationService::ListJobs(grpc::ServerContext*, const v1::ListJobsRequest* request,
                                           v1::ListJobsResponse* response) {
  return Answer("ListJobs", [&]() -> absl::Status {
    const int limit = request->limit();
    if (limit < 0)
      return absl::InvalidArgumentError(absl::StrCat("limit: ", limit, ", must not be negative"));
    const absl::StatusOr<std::vector<v1::Job>> jobs =
        queue_.List(limit == 0 ? kDefaultListLimit : std::min(limit, kMaxListLimit));
    if (!jobs.ok()) return jobs.status();
    response->mutable_jobs()->Assign(jobs->begin(), jobs->end());
    for (const std::string& warning : queue_.Warnings()) response->add_warnings(EscapedText(warning));
    return absl::OkStatus();
  });
}

grpc::ServerWriteReactor<v1::JobUpdate>* RegistrationService::WatchJob(grpc::CallbackServerContext*,
                                                                       const v1::WatchJobRequest* request) {
  return weft::WatchJob(queue_, request->job_id());
}

grpc::Status RegistrationService::CancelJob(grpc::ServerContext*, const v1::CancelJobRequest* request,
                                            v1::Job* job) {
  return Answer("CancelJob", [&]() -> absl::Status {
    if (absl::Status status = CheckJobId(request->job_id()); !status.ok()) return status;
    return Assign(queue_.Cancel(request->job_id()), job);
  });
}

grpc::Status RegistrationService::ListFrames(grpc::ServerContext*, const v1::ListFramesRequest* request,
                                             v1::ListFramesResponse* response) {
  return Answer("ListFrames", [&]() -> absl::Status {
    if (absl::Status status = CheckJobId(request->job_id()); !status.ok()) return status;
    const absl::StatusOr<std::vector<v1::FrameInfo>> frames = queue_.Frames(request->job_id());
    if (!frames.ok()) return frames.status();
    response->mutable_frames()->Assign(frames->begin(), frames->end());
    return absl::OkStatus();
  });
}

absl::Status RegistrationService::Fetch(const v1::FetchResultRequest& request,
                                        grpc::ServerWriter<v1::FileChunk>& writer) {
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
  const absl::StatusOr<std::string> path = FindResult(*job, request.frame(), request.kind());
  if (!path.ok()) return path.status();
  return StreamFile(*path, {request.offset(), request.version()},
                    [&writer](const v1::FileChunk& chunk) { return writer.Write(chunk); });
}

grpc::Status RegistrationService::FetchResult(grpc::ServerContext*, const v1::FetchResultRequest* request,
                                              grpc::ServerWriter<v1::FileChunk>* writer) {
  return Answer("FetchResult", [&] { return Fetch(*request, *writer); });
}

grpc::Status RegistrationService::FetchMesh(grpc::ServerContext*, const v1::FetchFrameRequest* request,
                                            grpc::ServerWriter<v1::FileChunk>* writer) {
  v1::FetchResultRequest fetch;
  fetch.set_job_id(request->job_id());
  fetch.set_frame(request->frame());
  fetch.set_kind(v1::RESULT_KIND_MESH);
  return Answer("FetchMesh", [&] { return Fetch(fetch, *writer); });
}

grpc::Status RegistrationService::FetchCloud(grpc::ServerContext*, const v1::FetchFrameRequest* request,
                                             grpc::ServerWriter<v1::FileChunk>* writer) {
  v1::FetchResultRequest fetch;
  fetch.set_job_id(request->job_id());
  fetch.set_frame(request->frame());
  fetch.set_kind(v1::RESULT_KIND_CLOUD);
  return Answer("FetchCloud", [&] { return Fetch(fetch, *writer); });
}

grpc::Status RegistrationService::GetServerInfo(grpc::ServerContext*, const v1::GetServerInfoRequest*,
                                                v1::ServerInfo* info) {
  return Answer("GetServerInfo", [&] {
    *info = info_;
    const JobQueue::Load load = queue_.CurrentLoad();
    info->set_jobs_queued(load.queued);
    info->set_jobs_running(load.running);
    for (const std::string& warning : queue_.Warnings()) info->add_warnings(EscapedText(warning));
    return absl::OkStatus();
  });
}

}  // namespace weft
