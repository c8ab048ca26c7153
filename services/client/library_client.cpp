#include "services/client/library_client.h"

#include <fcntl.h>
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "absl/strings/str_cat.h"
#include "capture/file/posix_file.h"
#include "services/rpc/grpc_status.h"

namespace weft {
namespace {

constexpr size_t kSentPieceBytes = size_t{256} << 10;
constexpr int kMaxTries = 5;  // in a row without any progress

}  // namespace

LibraryClient::LibraryClient(const std::string& server)
    : server_(server),
      stub_(v1::Library::NewStub(grpc::CreateChannel(server, grpc::InsecureChannelCredentials()))) {}

absl::Status LibraryClient::SendFile(const std::string& upload_id, const v1::ItemFile& file,
                                     const std::string& path, int64_t offset,
                                     const std::function<void(size_t)>& sent) {
  const absl::StatusOr<PosixFile> opened = PosixFile::Open(path, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
  if (!opened.ok()) return opened.status();
  grpc::ClientContext context;
  v1::WriteFileResponse response;
  const auto stream = stub_->WriteFile(&context, &response);
  v1::WriteFileRequest piece;
  piece.set_upload_id(upload_id);
  piece.set_path(file.path());
  for (bool taken = true; taken && offset < file.bytes();) {
    piece.set_offset(offset);
    std::string& data = *piece.mutable_data();
    data.resize(static_cast<size_t>(std::min<int64_t>(kSentPieceBytes, file.bytes() - offset)));
    if (absl::Status status = opened->ReadAt(data.data(), data.size(), static_cast<uint64_t>(offset));
        !status.ok()) {
      context.TryCancel();
      (void)stream->Finish();
      return status;
    }
    taken = stream->Write(piece);
    offset += static_cast<int64_t>(data.size());
    if (taken) sent(data.size());
  }
  stream->WritesDone();
  return FromGrpcStatus(stream->Finish());
}

absl::StatusOr<v1::LibraryItem> LibraryClient::UploadOnce(const v1::BeginUploadRequest& request,
                                                          const LocalItem& files,
                                                          const ProgressFunction& progress,
                                                          uint64_t* received) {
  grpc::ClientContext beginning, finishing;
  v1::BeginUploadResponse begun;
  if (const auto status = stub_->BeginUpload(&beginning, request, &begun); !status.ok())
    return FromGrpcStatus(status);
  if (begun.has_item()) return begun.item();
  if (begun.received_bytes_size() != request.manifest().files_size()) {
    return absl::InternalError(
        absl::StrCat("the daemon at ", server_, " counts other files than were named"));
  }
  uint64_t total = 0;
  *received = 0;
  for (int i = 0; i < begun.received_bytes_size(); ++i) {
    *received += static_cast<uint64_t>(begun.received_bytes(i));
    total += static_cast<uint64_t>(request.manifest().files(i).bytes());
  }
  uint64_t done = *received;
  for (int i = 0; i < begun.received_bytes_size(); ++i) {
    const v1::ItemFile& file = request.manifest().files(i);
    if (begun.received_bytes(i) >= file.bytes()) continue;
    const absl::Status status = SendFile(begun.upload_id(), file, files.paths[static_cast<size_t>(i)],
                                         begun.received_bytes(i), [&](size_t bytes) {
                                           done += bytes;
                                           if (progress) progress(done, total);
                                         });
    if (!status.ok()) return status;
  }
  v1::FinishUploadRequest finish;
  finish.set_upload_id(begun.upload_id());
  v1::LibraryItem item;
  const grpc::Status status = stub_->FinishUpload(&finishing, finish, &item);
  if (!status.ok()) return FromGrpcStatus(status);
  return item;
}

absl::StatusOr<v1::LibraryItem> LibraryClient::Upload(v1::ItemKind kind, const std::string& name,
                                                      const LocalItem& files,
                                                      const ProgressFunction& progress) {
  v1::BeginUploadRequest request;
  request.set_kind(kind);
  request.set_name(name);
  *request.mutable_manifest() = files.manifest;
  uint64_t most = 0;
  for (int tries = 1;; ++tries) {
    uint64_t received = 0;
    absl::StatusOr<v1::LibraryItem> item = UploadOnce(request, files, progress, &received);
    const bool broken = absl::IsUnavailable(item.status()) || absl::IsOutOfRange(item.status()) ||
                        absl::IsAborted(item.status()) || absl::IsDataLoss(item.status());
    if (item.ok() || !broken) return item;
    if (received > most) tries = 0;
    most = std::max(most, received);
    if (tries >= kMaxTries) return item;
    std::this_thread::sleep_for(std::chrono::milliseconds(200) * (tries + 1));
  }
}

absl::StatusOr<v1::ListItemsResponse> LibraryClient::List(v1::ItemKind kind) {
  grpc::ClientContext context;
  v1::ListItemsRequest request;
  request.set_kind(kind);
  v1::ListItemsResponse response;
  const grpc::Status status = stub_->ListItems(&context, request, &response);
  if (!status.ok()) return FromGrpcStatus(status);
  return response;
}

absl::StatusOr<v1::LibraryItem> LibraryClient::Get(v1::ItemKind kind, const std::string& item) {
  grpc::ClientContext context;
  v1::GetItemRequest request;
  request.set_kind(kind);
  request.set_item(item);
  v1::LibraryItem response;
  const grpc::Status status = stub_->GetItem(&context, request, &response);
  if (!status.ok()) return FromGrpcStatus(status);
  return response;
}

absl::StatusOr<v1::DeleteItemResponse> LibraryClient::Delete(v1::ItemKind kind, const std::string& item) {
  grpc::ClientContext context;
  v1::DeleteItemRequest request;
  request.set_kind(kind);
  request.set_item(item);
  v1::DeleteItemResponse response;
  const grpc::Status status = stub_->DeleteItem(&context, request, &response);
  if (!status.ok()) return FromGrpcStatus(status);
  return response;
}

}  // namespace weft
