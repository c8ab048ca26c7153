#include "services/tools/client/operation_client.h"

#include <grpcpp/grpcpp.h>

#include <filesystem>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/tools/client/daemon_call.h"
#include "services/tools/client/file_transfer.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

// Of a daemon that means well or does not: below the folder.
bool StaysBelow(const fs::path& path) {
  if (path.empty() || path.is_absolute()) return false;
  for (const fs::path& part : path) {
    if (part == "..") return false;
  }
  return true;
}

}  // namespace

absl::StatusOr<v1::Operation> OperationClient::Start(const v1::StartOperationRequest& request) {
  return CallDaemon<v1::Operation>(connection_, [&](grpc::ClientContext* context, v1::Operation* operation) {
    return stub_->StartOperation(context, request, operation);
  });
}

absl::StatusOr<v1::ListOperationsResponse> OperationClient::List(int limit) {
  return CallForPages<v1::ListOperationsResponse>(
      connection_, v1::ListOperationsRequest(), limit,
      [&](grpc::ClientContext* context, const v1::ListOperationsRequest& request,
          v1::ListOperationsResponse* response) { return stub_->ListOperations(context, request, response); },
      [](const v1::ListOperationsResponse& response) { return response.operations_size(); });
}

absl::StatusOr<v1::Operation> OperationClient::Delete(const std::string& id) {
  v1::DeleteOperationRequest request;
  request.set_operation_id(id);
  return CallDaemon<v1::Operation>(connection_, [&](grpc::ClientContext* context, v1::Operation* operation) {
    return stub_->DeleteOperation(context, request, operation);
  });
}

absl::StatusOr<v1::Operation> OperationClient::Cancel(const std::string& id) {
  v1::CancelOperationRequest request;
  request.set_operation_id(id);
  return CallDaemon<v1::Operation>(connection_, [&](grpc::ClientContext* context, v1::Operation* operation) {
    return stub_->CancelOperation(context, request, operation);
  });
}

absl::StatusOr<v1::Operation> OperationClient::Watch(const std::string& id,
                                                     const std::function<void(const v1::Operation&)>& update,
                                                     std::stop_token stop) {
  v1::WatchOperationRequest request;
  request.set_operation_id(id);
  v1::Operation operation;
  const grpc::Status status = CallWhenAdmitted([&] {
    grpc::ClientContext context;
    const std::stop_callback cancel(stop, [&context] { context.TryCancel(); });
    const auto stream = stub_->WatchOperation(&context, request);
    while (stream->Read(&operation)) {
      if (update) update(operation);
    }
    return stream->Finish();
  });
  if (status.ok()) return operation;
  if (stop.stop_requested()) {
    return absl::CancelledError(
        absl::StrCat("stopped watching; operation ", id, " goes on at ", connection_.server()));
  }
  return connection_.Explain(status);
}

absl::Status OperationClient::FetchFiles(const std::string& id, const std::string& folder,
                                         const std::function<void(size_t done, size_t total)>& progress) {
  v1::ListOperationFilesRequest of_operation;
  of_operation.set_operation_id(id);
  WEFT_ASSIGN_OR_RETURN(
      const auto list,
      CallForPages<v1::ListOperationFilesResponse>(
          connection_, of_operation, 0,
          [&](grpc::ClientContext* context, const v1::ListOperationFilesRequest& request,
              v1::ListOperationFilesResponse* response) {
            return stub_->ListOperationFiles(context, request, response);
          },
          [](const v1::ListOperationFilesResponse& response) { return response.files_size(); }));
  size_t done = 0;
  for (const v1::OperationFile& file : list.files()) {
    if (!StaysBelow(file.path())) {
      return absl::DataLossError(
          absl::StrCat("the daemon names a file outside of its folder: ", file.path()));
    }
    const fs::path path = fs::path(folder) / file.path();
    WEFT_RETURN_IF_ERROR(CreateFolders(path.parent_path()));
    v1::FetchOperationFileRequest request;
    request.set_operation_id(id);
    request.set_path(file.path());
    const OpenTransfer open = [&](grpc::ClientContext* context, int64_t offset, const std::string& version) {
      request.set_offset(offset);
      request.set_version(version);
      return stub_->FetchOperationFile(context, request);
    };
    WEFT_RETURN_IF_ERROR(ReceiveFile(connection_, open, path));
    progress(++done, static_cast<size_t>(list.files_size()));
  }
  return absl::OkStatus();
}

}  // namespace weft
