// The client's side of weftd.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "weft/v1/jobs.grpc.pb.h"
#include "weft/v1/server.pb.h"

namespace weft {

// Every call keeps the daemon's category and message. Unavailable: no daemon answers; the message names the
// server and the remedy. Thread safety: any thread may call any function.
class RegistrationClient {
 public:
  // `server` is HOST:PORT or unix:PATH; the environment says who the client is (ClientIdentity). Asks the
  // daemon who it is, so a wrong address shows here. FailedPrecondition: something else answers there.
  // Unauthenticated: the daemon does not know the client. Errors of OpenChannel besides.
  static absl::StatusOr<std::unique_ptr<RegistrationClient>> Connect(
      const std::string& server, std::chrono::milliseconds patience = std::chrono::seconds(5));

  const std::string& server() const { return server_; }
  const std::shared_ptr<grpc::ChannelInterface>& channel() const { return channel_; }
  // A failed call in words: for a silent daemon with server and remedy.
  absl::Status Explain(const grpc::Status& status) const;
  // As of Connect.
  const v1::ServerInfo& info() const { return info_; }

  // May take as long as the daemon needs to read the inputs. A request with an idempotency key is repeated
  // where the daemon went away, up to three times.
  absl::StatusOr<v1::Job> Submit(const v1::SubmitJobRequest& request);
  absl::StatusOr<v1::Job> Get(const std::string& job_id);
  // Newest first, at most `limit`.
  absl::StatusOr<std::vector<v1::Job>> List(int limit);
  absl::StatusOr<std::vector<v1::FrameInfo>> Frames(const std::string& job_id);
  // The job's last state.
  absl::StatusOr<v1::Job> Cancel(const std::string& job_id);
  // Queued again where it has failed or cancelled frames; otherwise as it is.
  absl::StatusOr<v1::Job> Retry(const std::string& job_id);

  // Calls `update` with the job's state now and at every change until it has ended, and returns its last
  // state. Cancelled: `stop` was requested; the job goes on. Unavailable: the daemon went away.
  absl::StatusOr<v1::Job> Watch(const std::string& job_id,
                                const std::function<void(const v1::JobUpdate&)>& update,
                                std::stop_token stop = {});

  // Writes one file of the results to `path`, whose folder must exist. A transfer that breaks off goes on
  // where it was. NotFound: there is no such result.
  // `mesh`: of RESULT_KIND_MESH, which one; empty as in FetchResultRequest.
  absl::Status Fetch(const std::string& job_id, const std::string& frame, v1::ResultKind kind,
                     const std::string& path, const std::string& mesh = "");

 private:
  RegistrationClient(std::string server, std::shared_ptr<grpc::ChannelInterface> channel)
      : server_(std::move(server)), channel_(std::move(channel)), stub_(v1::Jobs::NewStub(channel_)) {}

  const std::string server_;
  const std::shared_ptr<grpc::ChannelInterface> channel_;
  const std::unique_ptr<v1::Jobs::Stub> stub_;
  v1::ServerInfo info_;
};

}  // namespace weft
