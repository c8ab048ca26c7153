#include "services/tools/client/registration_client.h"

#include <grpcpp/grpcpp.h>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/server/rpc/error_detail.h"
#include "services/server/rpc/grpc_status.h"
#include "services/server/rpc/retry_after.h"
#include "services/tools/client/channel.h"
#include "services/tools/client/connection_fault.h"
#include "services/tools/client/daemon_call.h"
#include "services/tools/client/file_transfer.h"
#include "weft/v1/server.grpc.pb.h"

namespace weft {

absl::StatusOr<std::unique_ptr<RegistrationClient>> RegistrationClient::Connect(
    const std::string& server, std::chrono::milliseconds patience) {
  WEFT_ASSIGN_OR_RETURN(const auto opened, OpenChannel(server, ClientIdentity::FromEnvironment()));
  const std::shared_ptr<grpc::Channel>& channel = opened;
  std::unique_ptr<RegistrationClient> client(new RegistrationClient(server, channel));
  const grpc::Status status = CallWhenAdmitted([&] {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + patience);
    return v1::Server::NewStub(channel)->GetServerInfo(&context, {}, &client->info_);
  });
  if (status.error_code() == grpc::StatusCode::UNIMPLEMENTED) {
    return absl::FailedPreconditionError(
        absl::StrCat("what answers at ", server, " is not weftd; check host and port"));
  }
  if (!status.ok()) return client->Explain(status);
  return client;
}

absl::Status RegistrationClient::Explain(const grpc::Status& status) const {
  // Nobody here cancels a call whose end is explained: the daemon went away in the middle of it.
  if (status.error_code() == grpc::StatusCode::CANCELLED)
    return absl::UnavailableError(
        absl::StrCat("the daemon at ", server_, " stopped before it answered (", status.error_message(),
                     "); look whether the call took effect before it is made again"));
  const bool silent = status.error_code() == grpc::StatusCode::UNAVAILABLE ||
                      status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED;
  if (!silent) return FromGrpcStatus(status);
  // What the daemon itself says when it is busy, or asked to stop.
  if (RetryAfter(status.error_message()) || absl::StrContains(status.error_message(), "shutting down") ||
      DetailOf(FromGrpcStatus(status)))
    return FromGrpcStatus(status);
  if (const std::string fault = FindConnectionFault(server_, ClientIdentity::FromEnvironment());
      !fault.empty())
    return absl::FailedPreconditionError(
        absl::StrCat("no call reaches the daemon at ", server_, ": ", fault));
  return absl::UnavailableError(absl::StrCat("no daemon answers at ", server_, ": ", status.error_message(),
                                             "; start it with `weftd --listen ", server_,
                                             " --state DIR --allow-path DIR`"));
}

absl::StatusOr<v1::Job> RegistrationClient::Submit(const v1::SubmitJobRequest& request) {
  const std::chrono::minutes patience(10);
  if (!request.idempotency_key().empty()) {
    return CallDaemon(*this, *stub_, &v1::Jobs::Stub::SubmitJob, request, patience);
  }
  return CallDaemonOnce(*this, *stub_, &v1::Jobs::Stub::SubmitJob, request, patience);
}

absl::StatusOr<v1::Job> RegistrationClient::Get(const std::string& job_id) {
  return CallDaemon(*this, *stub_, &v1::Jobs::Stub::GetJob, RequestNaming<v1::GetJobRequest>(job_id));
}

absl::StatusOr<std::vector<v1::Job>> RegistrationClient::List(int limit) {
  constexpr int kUsual = 100;  // as the daemon's
  WEFT_ASSIGN_OR_RETURN(const auto response,
                        CallForPages(*this, *stub_, &v1::Jobs::Stub::ListJobs, v1::ListJobsRequest(),
                                     limit == 0 ? kUsual : limit, &v1::ListJobsResponse::jobs_size));
  return std::vector<v1::Job>(response.jobs().begin(), response.jobs().end());
}

absl::StatusOr<std::vector<v1::FrameInfo>> RegistrationClient::Frames(const std::string& job_id) {
  WEFT_ASSIGN_OR_RETURN(const auto response, CallForPages(*this, *stub_, &v1::Jobs::Stub::ListFrames,
                                                          RequestNaming<v1::ListFramesRequest>(job_id), 0,
                                                          &v1::ListFramesResponse::frames_size));
  return std::vector<v1::FrameInfo>(response.frames().begin(), response.frames().end());
}

absl::StatusOr<v1::Job> RegistrationClient::Cancel(const std::string& job_id) {
  return CallDaemon(*this, *stub_, &v1::Jobs::Stub::CancelJob, RequestNaming<v1::CancelJobRequest>(job_id));
}

absl::StatusOr<v1::Job> RegistrationClient::Retry(const std::string& job_id) {
  return CallDaemon(*this, *stub_, &v1::Jobs::Stub::RetryJob, RequestNaming<v1::RetryJobRequest>(job_id));
}

absl::StatusOr<v1::Job> RegistrationClient::Watch(const std::string& job_id,
                                                  const std::function<void(const v1::JobUpdate&)>& update,
                                                  std::stop_token stop) {
  v1::Job last;
  const auto keep = [&](const v1::JobUpdate& now) {
    last = now.job();
    if (update) update(now);
  };
  const grpc::Status status = ReadStream<v1::JobUpdate>(
      *stub_, &v1::Jobs::Stub::WatchJob, RequestNaming<v1::WatchJobRequest>(job_id), stop, keep);
  if (status.ok()) return last;
  if (stop.stop_requested()) {
    return absl::CancelledError(absl::StrCat("stopped watching; job ", job_id, " continues at ", server_));
  }
  if (status.error_code() == grpc::StatusCode::UNAVAILABLE && !last.id().empty()) {
    return absl::UnavailableError(
        absl::StrCat("the daemon at ", server_, " went away (", status.error_message(), "); job ", job_id,
                     " continues when it is started again: `weft job watch ", job_id, "`"));
  }
  return Explain(status);
}

absl::Status RegistrationClient::Fetch(const std::string& job_id, const std::string& frame,
                                       v1::ResultKind kind, const std::string& path,
                                       const std::string& mesh) {
  v1::FetchResultRequest request;
  request.set_mesh(mesh);
  request.set_job_id(job_id);
  request.set_frame(frame);
  request.set_kind(kind);
  const OpenTransfer open = [&](grpc::ClientContext* context, int64_t offset, const std::string& version) {
    request.set_offset(offset);
    request.set_version(version);
    return stub_->FetchResult(context, request);
  };
  return ReceiveFile(*this, open, path);
}

}  // namespace weft
