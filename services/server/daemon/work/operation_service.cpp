#include "services/server/daemon/work/operation_service.h"

#include "base/status_macros.h"
#include "services/server/daemon/calls/answer.h"
#include "services/server/daemon/calls/file_stream.h"
#include "services/server/daemon/calls/request_check.h"
#include "services/server/daemon/calls/server_stream.h"
#include "weft/v1/operations.grpc.pb.h"

namespace weft {
namespace {

class OperationService final
    : public v1::Operations::WithCallbackMethod_WatchOperation<
          v1::Operations::WithCallbackMethod_FetchOperationFile<v1::Operations::Service>> {
 public:
  OperationService(OperationQueue& operations, FindCaller caller)
      : operations_(operations), caller_(std::move(caller)) {}

  grpc::Status StartOperation(CallContext* context, const v1::StartOperationRequest* request,
                              v1::Operation* operation) override {
    return Answer("StartOperation",
                  [&] { return Assign(operations_.Start(*request, caller_(*context)), operation); });
  }

  grpc::Status GetOperation(CallContext*, const v1::GetOperationRequest* request,
                            v1::Operation* operation) override {
    return Answer("GetOperation",
                  [&] { return Assign(operations_.Get(request->operation_id()), operation); });
  }

  grpc::Status ListOperations(CallContext*, const v1::ListOperationsRequest* request,
                              v1::ListOperationsResponse* response) override {
    return Answer("ListOperations", [&]() -> absl::Status {
      WEFT_ASSIGN_OR_RETURN(const int limit, LimitOf(request->limit()));
      return Assign(operations_.List(static_cast<size_t>(limit), request->page_token()), response);
    });
  }

  grpc::ServerWriteReactor<v1::Operation>* WatchOperation(grpc::CallbackServerContext* context,
                                                          const v1::WatchOperationRequest* request) override {
    return WatchByLooking<v1::Operation>(
        context, "WatchOperation", [this, id = request->operation_id()] { return operations_.Get(id); },
        [](const v1::Operation& operation) { return HasEnded(operation); });
  }

  grpc::Status CancelOperation(CallContext* context, const v1::CancelOperationRequest* request,
                               v1::Operation* operation) override {
    return Answer("CancelOperation", [&] {
      return Assign(operations_.Cancel(request->operation_id(), caller_(*context)), operation);
    });
  }

  grpc::Status DeleteOperation(CallContext* context, const v1::DeleteOperationRequest* request,
                               v1::Operation* operation) override {
    return Answer("DeleteOperation", [&] {
      return Assign(operations_.Delete(request->operation_id(), caller_(*context)), operation);
    });
  }

  grpc::Status ListOperationFiles(CallContext*, const v1::ListOperationFilesRequest* request,
                                  v1::ListOperationFilesResponse* response) override {
    return Answer("ListOperationFiles", [&]() -> absl::Status {
      const absl::StatusOr<int> limit = LimitOrAll(request->limit());
      if (!limit.ok()) return limit.status();
      return Assign(operations_.Files(*request), response);
    });
  }

  grpc::ServerWriteReactor<v1::FileChunk>* FetchOperationFile(
      grpc::CallbackServerContext* context, const v1::FetchOperationFileRequest* request) override {
    return SendFile(context, "FetchOperationFile", [&]() -> absl::StatusOr<FilePieces> {
      WEFT_RETURN_IF_ERROR(CheckOffset(request->offset()));
      return operations_.OpenFile(request->operation_id(), request->path(),
                                  {request->offset(), request->version()});
    });
  }

 private:
  OperationQueue& operations_;
  const FindCaller caller_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeOperationService(OperationQueue& operations, FindCaller caller) {
  return std::make_unique<OperationService>(operations, std::move(caller));
}

}  // namespace weft
