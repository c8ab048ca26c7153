// The service Operations.
#pragma once

#include "services/server/daemon/door/call_identity.h"
#include "services/server/daemon/work/operation_queue.h"
#include "weft/v1/operations.grpc.pb.h"

namespace weft {

// Thread safety: gRPC calls from many threads. The queue must outlive the service.
class OperationService final
    : public v1::Operations::WithCallbackMethod_WatchOperation<
          v1::Operations::WithCallbackMethod_FetchOperationFile<v1::Operations::Service>> {
 public:
  OperationService(OperationQueue& operations, FindCaller caller)
      : operations_(operations), caller_(std::move(caller)) {}

  grpc::Status StartOperation(grpc::ServerContext* context, const v1::StartOperationRequest* request,
                              v1::Operation* operation) override;
  grpc::Status GetOperation(grpc::ServerContext* context, const v1::GetOperationRequest* request,
                            v1::Operation* operation) override;
  grpc::Status ListOperations(grpc::ServerContext* context, const v1::ListOperationsRequest* request,
                              v1::ListOperationsResponse* response) override;
  grpc::ServerWriteReactor<v1::Operation>* WatchOperation(grpc::CallbackServerContext* context,
                                                          const v1::WatchOperationRequest* request) override;
  grpc::Status CancelOperation(grpc::ServerContext* context, const v1::CancelOperationRequest* request,
                               v1::Operation* operation) override;
  grpc::Status DeleteOperation(grpc::ServerContext* context, const v1::DeleteOperationRequest* request,
                               v1::Operation* operation) override;
  grpc::Status ListOperationFiles(grpc::ServerContext* context, const v1::ListOperationFilesRequest* request,
                                  v1::ListOperationFilesResponse* response) override;
  grpc::ServerWriteReactor<v1::FileChunk>* FetchOperationFile(
      grpc::CallbackServerContext* context, const v1::FetchOperationFileRequest* request) override;

 private:
  OperationQueue& operations_;
  const FindCaller caller_;
};

}  // namespace weft
