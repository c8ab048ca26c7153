// The service Takes.
#pragma once

#include "services/daemon/session_keeper.h"
#include "services/daemon/take_keeper.h"
#include "weft/v1/takes.grpc.pb.h"

namespace weft {

// Thread safety: gRPC calls from many threads. The keepers must outlive the service.
class TakeService final : public v1::Takes::WithCallbackMethod_WatchTake<v1::Takes::Service> {
 public:
  TakeService(TakeKeeper& takes, SessionKeeper& sessions) : takes_(takes), sessions_(sessions) {}

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
  grpc::Status DeleteTake(grpc::ServerContext* context, const v1::DeleteTakeRequest* request,
                          v1::RecordedTake* take) override;
  grpc::Status RestoreTake(grpc::ServerContext* context, const v1::RestoreTakeRequest* request,
                           v1::RecordedTake* take) override;
  grpc::Status EmptyTrash(grpc::ServerContext* context, const v1::EmptyTrashRequest* request,
                          v1::EmptyTrashResponse* response) override;

 private:
  absl::StatusOr<v1::RecordedTake> Start(const v1::StartTakeRequest& request);

  TakeKeeper& takes_;
  SessionKeeper& sessions_;
};

}  // namespace weft
