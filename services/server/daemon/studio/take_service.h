// The service Takes.
#pragma once

#include <chrono>
#include <map>
#include <string>

#include "base/mutex.h"
#include "services/server/daemon/door/call_identity.h"
#include "services/server/daemon/studio/session_registry.h"
#include "services/server/daemon/studio/take_store.h"
#include "services/server/daemon/work/job_queue.h"
#include "weft/v1/takes.grpc.pb.h"

namespace weft {

// Thread safety: gRPC calls from many threads. Stores and queue must outlive the service.
class TakeService final : public v1::Takes::WithCallbackMethod_WatchTake<v1::Takes::Service> {
 public:
  TakeService(TakeStore& takes, SessionRegistry& sessions, JobQueue& jobs, FindCaller caller)
      : takes_(takes), sessions_(sessions), jobs_(jobs), caller_(std::move(caller)) {}

  grpc::Status StartTake(grpc::ServerContext* context, const v1::StartTakeRequest* request,
                         v1::RecordedTake* take) override;
  grpc::Status StopTake(grpc::ServerContext* context, const v1::StopTakeRequest* request,
                        v1::RecordedTake* take) override;
  grpc::Status GetTake(grpc::ServerContext* context, const v1::GetTakeRequest* request,
                       v1::RecordedTake* take) override;
  grpc::Status ListTakes(grpc::ServerContext* context, const v1::ListTakesRequest* request,
                         v1::ListTakesResponse* response) override;
  grpc::ServerWriteReactor<v1::RecordedTake>* WatchTake(grpc::CallbackServerContext* context,
                                                        const v1::WatchTakeRequest* request) override;
  grpc::Status PinTake(grpc::ServerContext* context, const v1::PinTakeRequest* request,
                       v1::RecordedTake* take) override;
  grpc::Status DescribeTake(grpc::ServerContext* context, const v1::DescribeTakeRequest* request,
                            v1::RecordedTake* take) override;
  grpc::Status DeleteTake(grpc::ServerContext* context, const v1::DeleteTakeRequest* request,
                          v1::RecordedTake* take) override;
  grpc::Status RestoreTake(grpc::ServerContext* context, const v1::RestoreTakeRequest* request,
                           v1::RecordedTake* take) override;
  grpc::Status EmptyTrash(grpc::ServerContext* context, const v1::EmptyTrashRequest* request,
                          v1::EmptyTrashResponse* response) override;

 private:
  absl::StatusOr<v1::RecordedTake> Start(const v1::StartTakeRequest& request, const Caller& caller);
  // With the job that registers it live.
  absl::StatusOr<v1::RecordedTake> Get(const std::string& id);
  // The same, at most one period of the watchers old: many of them cost what one does.
  absl::StatusOr<v1::RecordedTake> GetRecent(const std::string& id);

  struct Look {
    std::chrono::steady_clock::time_point at;
    absl::StatusOr<v1::RecordedTake> take;
  };
  Mutex looking_;
  std::map<std::string, Look> looks_ ABSL_GUARDED_BY(looking_);  // by take

  TakeStore& takes_;
  SessionRegistry& sessions_;
  JobQueue& jobs_;
  const FindCaller caller_;
};

}  // namespace weft
