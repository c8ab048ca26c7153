// The service Takes.
#pragma once

#include "services/daemon/take_keeper.h"
#include "weft/v1/takes.grpc.pb.h"

namespace weft {

// Thread safety: gRPC calls from many threads. `takes` must outlive the service.
class TakeService final : public v1::Takes::WithCallbackMethod_WatchTake<v1::Takes::Service> {
 public:
  explicit TakeService(TakeKeeper& takes) : takes_(takes) {}

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

 private:
  TakeKeeper& takes_;
};

}  // namespace weft
