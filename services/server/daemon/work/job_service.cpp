#include "services/server/daemon/work/job_service.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/file/plain_text.h"
#include "services/server/callers/owners.h"
#include "services/server/daemon/calls/answer.h"
#include "services/server/daemon/calls/file_stream.h"
#include "services/server/daemon/calls/name_locks.h"
#include "services/server/daemon/calls/request_check.h"
#include "services/server/daemon/calls/server_stream.h"
#include "services/server/daemon/work/known_inputs.h"
#include "services/server/daemon/work/result_owner.h"
#include "services/server/daemon/work/results.h"
#include "services/server/rpc/error_detail.h"
#include "services/server/rpc/page.h"
#include "weft/v1/jobs.grpc.pb.h"

namespace weft {
namespace {

// A page is named by the position of its first frame, since frames are only added at the end.
absl::Status FillPage(const v1::ListFramesRequest& request, const std::vector<v1::FrameInfo>& frames,
                      v1::ListFramesResponse& response) {
  WEFT_ASSIGN_OR_RETURN(const int limit, LimitOrAll(request.limit()));
  size_t first = 0;
  if (!request.page_token().empty() && !absl::SimpleAtoi(request.page_token(), &first)) {
    return FieldError(absl::StatusCode::kInvalidArgument,
                      {"page_token", "is none", "give next_page_token of the page before"});
  }
  Page page(static_cast<size_t>(limit));
  for (size_t i = first; i < frames.size(); ++i) {
    if (!page.Add(frames[i].ByteSizeLong())) {
      response.set_next_page_token(absl::StrCat(i));
      break;
    }
    *response.add_frames() = frames[i];
  }
  return absl::OkStatus();
}

// One who watches a job, as long as this lives.
struct Watch {
  explicit Watch(JobQueue& jobs) : queue(jobs) {}
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;
  ~Watch() {
    if (watcher != 0) queue.Unsubscribe(watcher);
  }

  JobQueue& queue;
  int64_t watcher = 0;
};

class JobService final : public v1::Jobs::WithCallbackMethod_WatchJob<
                             v1::Jobs::WithCallbackMethod_FetchResult<v1::Jobs::Service>> {
 public:
  explicit JobService(JobServiceParts parts) : parts_(std::move(parts)), queue_(parts_.queue) {}

  grpc::Status SubmitJob(CallContext* context, const v1::SubmitJobRequest* request, v1::Job* job) override {
    return Answer("SubmitJob", [&] { return Assign(Submit(*request, parts_.caller(*context)), job); });
  }

  grpc::Status GetJob(CallContext*, const v1::GetJobRequest* request, v1::Job* job) override {
    return Answer("GetJob", [&]() -> absl::Status {
      WEFT_RETURN_IF_ERROR(CheckJobId(request->job_id()));
      return Assign(queue_.Get(request->job_id()), job);
    });
  }

  grpc::Status ListJobs(CallContext*, const v1::ListJobsRequest* request,
                        v1::ListJobsResponse* response) override {
    return Answer("ListJobs", [&]() -> absl::Status {
      WEFT_ASSIGN_OR_RETURN(const int limit, LimitOf(request->limit()));
      WEFT_RETURN_IF_ERROR(CheckPageToken(request->page_token()));
      // One more tells whether there is a next page.
      absl::StatusOr<std::vector<v1::Job>> jobs = queue_.List(limit + 1, request->page_token());
      if (absl::IsNotFound(jobs.status())) {
        return FieldError(absl::StatusCode::kInvalidArgument,
                          {"page_token", "names a job that is gone", "begin with the first page"});
      }
      if (!jobs.ok()) return jobs.status();
      Page page(static_cast<size_t>(limit));
      for (v1::Job& job : *jobs) {
        if (!page.Add(job.ByteSizeLong())) {
          response->set_next_page_token(response->jobs().rbegin()->id());
          break;
        }
        *response->add_jobs() = std::move(job);
      }
      if (!request->page_token().empty()) return absl::OkStatus();
      for (const std::string& warning : queue_.Warnings()) response->add_warnings(EscapedText(warning));
      return absl::OkStatus();
    });
  }

  grpc::ServerWriteReactor<v1::JobUpdate>* WatchJob(grpc::CallbackServerContext* context,
                                                    const v1::WatchJobRequest* request) override {
    auto* stream = new ServerStream<v1::JobUpdate>(context, "WatchJob", StallWatch::kReadTimeout);
    stream->Begin([watch = std::make_shared<Watch>(queue_), id = request->job_id(),
                   bell = stream->bell()](v1::JobUpdate& update) -> absl::StatusOr<StreamNews> {
      if (watch->watcher == 0) {
        WEFT_RETURN_IF_ERROR(CheckJobId(id));
        WEFT_ASSIGN_OR_RETURN(watch->watcher, watch->queue.Subscribe(id, bell));
      }
      JobQueue::Updates updates = watch->queue.PollUpdates(watch->watcher);
      if (updates.stopping) return absl::UnavailableError("the daemon is shutting down");
      if (!updates.update) return StreamNews::kNone;
      update = *std::move(updates.update);
      return updates.ended ? StreamNews::kLast : StreamNews::kMessage;
    });
    return stream;
  }

  grpc::Status CancelJob(CallContext* context, const v1::CancelJobRequest* request, v1::Job* job) override {
    return Answer("CancelJob", [&]() -> absl::Status {
      WEFT_RETURN_IF_ERROR(CheckOwns(request->job_id(), parts_.caller(*context)));
      return Assign(queue_.Cancel(request->job_id()), job);
    });
  }

  grpc::Status RetryJob(CallContext* context, const v1::RetryJobRequest* request, v1::Job* job) override {
    return Answer("RetryJob", [&] { return Assign(Retry(request->job_id(), parts_.caller(*context)), job); });
  }

  grpc::Status SetJobPriority(CallContext* context, const v1::SetJobPriorityRequest* request,
                              v1::Job* job) override {
    return Answer("SetJobPriority", [&]() -> absl::Status {
      const Caller caller = parts_.caller(*context);
      WEFT_RETURN_IF_ERROR(CheckOwns(request->job_id(), caller));
      WEFT_RETURN_IF_ERROR(CheckPriority(request->priority()));
      if (PriorityFor(caller, request->priority()) != request->priority()) {
        return FieldError(absl::StatusCode::kPermissionDenied,
                          {"priority", absl::StrCat(request->priority(), " is for operators"),
                           absl::StrCat("give at most ", kMostPriorityOfClients, ", or ask an operator")});
      }
      return Assign(queue_.SetPriority(request->job_id(), request->priority()), job);
    });
  }

  grpc::Status ListWorkKinds(CallContext*, const v1::ListWorkKindsRequest*,
                             v1::ListWorkKindsResponse* response) override {
    for (const v1::WorkKindInfo* info : AllKindInfos()) *response->add_kinds() = *info;
    return grpc::Status::OK;
  }

  grpc::Status ListFrames(CallContext*, const v1::ListFramesRequest* request,
                          v1::ListFramesResponse* response) override {
    return Answer("ListFrames", [&]() -> absl::Status {
      WEFT_RETURN_IF_ERROR(CheckJobId(request->job_id()));
      WEFT_ASSIGN_OR_RETURN(const std::vector<v1::FrameInfo> frames, queue_.Frames(request->job_id()));
      return FillPage(*request, frames, *response);
    });
  }

  grpc::ServerWriteReactor<v1::FileChunk>* FetchResult(grpc::CallbackServerContext* context,
                                                       const v1::FetchResultRequest* request) override {
    return SendFile(context, "FetchResult", [&] { return OpenResult(*request); });
  }

 private:
  absl::StatusOr<v1::Job> Submit(const v1::SubmitJobRequest& request, const Caller& caller) {
    // A repeated request waits here until the first one is queued.
    const auto lock = submitting_.Lock(request.idempotency_key());
    absl::StatusOr<v1::Job> submitted = FindSubmitted(request, caller);
    if (!absl::IsNotFound(submitted.status())) return submitted;
    WEFT_ASSIGN_OR_RETURN(
        PreparedJob prepared,
        PrepareJob(request, {parts_.policy, parts_.library, parts_.resolve, parts_.results_folder, known_},
                   caller.name, parts_.load));
    v1::Job& job = prepared.job;
    job.set_submitted_by(caller.name);
    WEFT_RETURN_IF_ERROR(CheckResultOwner(job, prepared.frames, caller));
    if (const int priority = PriorityFor(caller, job.priority()); priority != job.priority()) {
      job.add_warnings(absl::StrCat("priority ", job.priority(), " became ", priority,
                                    ": higher ones are for operators, who may raise it"));
      job.set_priority(priority);
    }
    const std::string id = job.id();
    WEFT_RETURN_IF_ERROR(queue_.Submit(std::move(job), prepared.frames, caller.role));
    return queue_.Get(id);
  }

  // The job of an earlier request with the same idempotency key. NotFound: there is none. AlreadyExists: that
  // request asked for something else, or somebody else made it.
  absl::StatusOr<v1::Job> FindSubmitted(const v1::SubmitJobRequest& request, const Caller& caller) {
    const std::string& key = request.idempotency_key();
    if (key.empty()) return absl::NotFoundError("no key");
    absl::StatusOr<v1::Job> job = queue_.Get(key);
    if (!job.ok()) return job;
    WEFT_RETURN_IF_ERROR(CheckRepeats(caller, job->submitted_by(),
                                      job->request_hash() == HashOfRequest(request),
                                      absl::StrCat("job ", key, " was submitted")));
    return job;
  }

  // Whether the caller may change this job. NotFound; PermissionDenied.
  absl::Status CheckOwns(const std::string& job_id, const Caller& caller) {
    WEFT_RETURN_IF_ERROR(CheckJobId(job_id));
    WEFT_ASSIGN_OR_RETURN(const v1::Job job, queue_.Get(job_id));
    return CheckMayChange(caller, "job_id", absl::StrCat("job ", job_id), job.submitted_by());
  }

  absl::StatusOr<v1::Job> Retry(const std::string& job_id, const Caller& caller) {
    WEFT_RETURN_IF_ERROR(CheckOwns(job_id, caller));
    const absl::StatusOr<v1::Job> job = queue_.Get(job_id);
    if (!job.ok()) return job;
    WEFT_ASSIGN_OR_RETURN(const std::vector<v1::FrameInfo> infos, queue_.Frames(job_id));
    std::vector<std::string> frames;
    for (const v1::FrameInfo& info : infos) frames.push_back(info.frame());
    // Somebody else may have written there since.
    WEFT_RETURN_IF_ERROR(CheckResultOwner(*job, frames, caller));
    return queue_.Retry(job_id, caller.role);
  }

  absl::StatusOr<FilePieces> OpenResult(const v1::FetchResultRequest& request) {
    WEFT_RETURN_IF_ERROR(CheckFetchRequest(request));
    WEFT_ASSIGN_OR_RETURN(const v1::Job job, queue_.Get(request.job_id()));
    if (!request.frame().empty()) {
      WEFT_ASSIGN_OR_RETURN(const std::vector<v1::FrameInfo> frames, queue_.Frames(request.job_id()));
      const bool known = std::any_of(frames.begin(), frames.end(), [&](const v1::FrameInfo& info) {
        return info.frame() == request.frame();
      });
      if (!known) {
        return absl::NotFoundError(
            absl::StrCat("job ", request.job_id(), " has no frame \"", request.frame(), "\""));
      }
    }
    return weft::OpenResult(job, request);
  }

  const JobServiceParts parts_;
  JobQueue& queue_;
  NameLocks submitting_;  // by idempotency key
  KnownInputs known_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeJobService(JobServiceParts parts) {
  return std::make_unique<JobService>(std::move(parts));
}

}  // namespace weft
