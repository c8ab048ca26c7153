#include "services/server/daemon/work/operation_service.h"

#include "base/status_macros.h"
#include "services/server/daemon/calls/answer.h"
#include "services/server/daemon/calls/file_stream.h"
#include "services/server/daemon/calls/request_check.h"
#include "services/server/daemon/calls/server_stream.h"

namespace weft {

grpc::Status OperationService::StartOperation(grpc::ServerContext* context,
                                              const v1::StartOperationRequest* request,
                                              v1::Operation* operation) {
  return Answer("StartOperation",
                [&] { return Assign(operations_.Start(*request, caller_(*context)), operation); });
}

grpc::Status OperationService::GetOperation(grpc::ServerContext*, const v1::GetOperationRequest* request,
                                            v1::Operation* operation) {
  return Answer("GetOperation", [&] { return Assign(operations_.Get(request->operation_id()), operation); });
}

grpc::Status OperationService::ListOperations(grpc::ServerContext*, const v1::ListOperationsRequest* request,
                                              v1::ListOperationsResponse* response) {
  return Answer("ListOperations", [&]() -> absl::Status {
    WEFT_ASSIGN_OR_RETURN(const int limit, LimitOf(request->limit()));
    return Assign(operations_.List(static_cast<size_t>(limit), request->page_token()), response);
  });
}

grpc::ServerWriteReactor<v1::Operation>* OperationService::WatchOperation(
    grpc::CallbackServerContext* context, const v1::WatchOperationRequest* request) {
  return WatchByLooking<v1::Operation>(
      context, "WatchOperation", [this, id = request->operation_id()] { return operations_.Get(id); },
      [](const v1::Operation& operation) { return HasEnded(operation); });
}

grpc::Status OperationService::CancelOperation(grpc::ServerContext* context,
                                               const v1::CancelOperationRequest* request,
                                               v1::Operation* operation) {
  return Answer("CancelOperation", [&] {
    return Assign(operations_.Cancel(request->operation_id(), caller_(*context)), operation);
  });
}

grpc::Status OperationService::DeleteOperation(grpc::ServerContext* context,
                                               const v1::DeleteOperationRequest* request,
                                               v1::Operation* operation) {
  return Answer("DeleteOperation", [&] {
    return Assign(operations_.Delete(request->operation_id(), caller_(*context)), operation);
  });
}

grpc::Status OperationService::ListOperationFiles(grpc::ServerContext*,
                                                  const v1::ListOperationFilesRequest* request,
                                                  v1::ListOperationFilesResponse* response) {
  return Answer("ListOperationFiles", [&]() -> absl::Status {
    const absl::StatusOr<int> limit = LimitOrAll(request->limit());
    if (!limit.ok()) return limit.status();
    return Assign(operations_.Files(*request), response);
  });
}

grpc::ServerWriteReactor<v1::FileChunk>* OperationService::FetchOperationFile(
    grpc::CallbackServerContext* context, const v1::FetchOperationFileRequest* request) {
  return SendFile(context, "FetchOperationFile", [&]() -> absl::StatusOr<FilePieces> {
    WEFT_RETURN_IF_ERROR(CheckOffset(request->offset()));
    return operations_.OpenFile(request->operation_id(), request->path(),
                                {request->offset(), request->version()});
  });
}

}  // namespace weft
