#include "services/tools/client/library_client.h"

#include <fcntl.h>
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <thread>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/file/posix_file.h"
#include "services/formats/files/atomic_file.h"
#include "services/server/rpc/retry_after.h"
#include "services/work/items/item_path.h"
#include "services/work/items/manifest.h"
#include "services/work/items/sha256.h"

namespace weft {
namespace {

constexpr size_t kSentPieceBytes = size_t{256} << 10;
constexpr size_t kSentManifestBytes = size_t{512} << 10;
constexpr int kMaxTries = 5;  // in a row without any progress

constexpr std::chrono::minutes kLibraryPatience{10};

// Broken calls, those that a busy daemon refused, and uploads that others finish or change meanwhile.
bool IsWorthAnotherTry(const absl::Status& status) {
  return absl::IsUnavailable(status) || absl::IsOutOfRange(status) || absl::IsAborted(status) ||
         absl::IsNotFound(status) || absl::IsFailedPrecondition(status) || absl::IsDataLoss(status) ||
         RetryAfter(std::string(status.message())).has_value();
}

// Waits longer from try to try.
void PauseBeforeTry(int tries) { std::this_thread::sleep_for(std::chrono::milliseconds(200) * (tries + 1)); }

bool HasHash(const std::string& path, const std::string& sha256) {
  const absl::StatusOr<std::string> hash = Sha256OfFile(path);
  return hash.ok() && *hash == sha256;
}

}  // namespace

struct LibraryClient::Attempt {
  const ProgressFunction& progress;
  uint64_t received = 0;  // by the daemon before
  uint64_t done = 0, total = 0;
  bool may_be_repeated = false;
};

absl::StatusOr<v1::BeginUploadResponse> LibraryClient::Begin(const v1::BeginUploadRequest& request) {
  v1::BeginUploadResponse response;
  const grpc::Status status = CallWhenAdmitted([&] { return SendManifest(request, &response); });
  if (!status.ok()) return connection_.Explain(status);
  return response;
}

grpc::Status LibraryClient::SendManifest(const v1::BeginUploadRequest& request,
                                         v1::BeginUploadResponse* response) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kLibraryPatience);
  const auto stream = stub_->BeginUpload(&context, response);
  v1::BeginUploadRequest message;
  message.set_kind(request.kind());
  message.set_name(request.name());
  size_t bytes = 0;
  for (const v1::ItemFile& file : request.manifest().files()) {
    bytes += file.ByteSizeLong();
    if (bytes > kSentManifestBytes) {
      if (!stream->Write(message)) break;
      message.Clear();
      bytes = file.ByteSizeLong();
    }
    *message.mutable_manifest()->add_files() = file;
  }
  stream->Write(message);
  stream->WritesDone();
  return stream->Finish();
}

absl::Status LibraryClient::SendFiles(const v1::BeginUploadResponse& begun, const LocalItem& files,
                                      Attempt* attempt) {
  grpc::ClientContext context;
  v1::WriteFileResponse response;
  const auto stream = stub_->WriteFile(&context, &response);
  v1::WriteFileRequest piece;
  piece.set_upload_id(begun.upload_id());
  bool taken = true;
  for (int i = 0; taken && i < files.manifest.files_size(); ++i) {
    const v1::ItemFile& file = files.manifest.files(i);
    int64_t offset = begun.received_bytes(i);
    if (offset >= file.bytes()) continue;
    const auto opened =
        PosixFile::Open(files.paths[static_cast<size_t>(i)], O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    absl::Status status = opened.status();
    piece.set_path(file.path());
    while (status.ok() && taken && offset < file.bytes()) {
      std::string& data = *piece.mutable_data();
      data.resize(static_cast<size_t>(std::min<int64_t>(kSentPieceBytes, file.bytes() - offset)));
      status = opened->ReadAt(data.data(), data.size(), static_cast<uint64_t>(offset));
      if (!status.ok()) break;
      piece.set_offset(offset);
      taken = stream->Write(piece);
      offset += static_cast<int64_t>(data.size());
      attempt->done += data.size();
      if (taken && attempt->progress) attempt->progress(attempt->done, attempt->total);
    }
    if (!status.ok()) {
      context.TryCancel();
      (void)stream->Finish();
      attempt->may_be_repeated = false;
      return status;
    }
  }
  stream->WritesDone();
  const grpc::Status status = stream->Finish();
  return status.ok() ? absl::OkStatus() : connection_.Explain(status);
}

absl::StatusOr<v1::LibraryItem> LibraryClient::UploadOnce(const v1::BeginUploadRequest& request,
                                                          const LocalItem& files, Attempt* attempt) {
  attempt->may_be_repeated = true;
  const absl::StatusOr<v1::BeginUploadResponse> begun = Begin(request);
  if (!begun.ok()) {
    attempt->may_be_repeated = absl::IsUnavailable(begun.status());
    return begun.status();
  }
  if (begun->has_item()) return begun->item();
  if (begun->received_bytes_size() != request.manifest().files_size()) {
    attempt->may_be_repeated = false;
    return absl::InternalError(
        absl::StrCat("the daemon at ", connection_.server(), " counts other files than were named"));
  }
  attempt->received = 0;
  for (const int64_t bytes : begun->received_bytes()) attempt->received += static_cast<uint64_t>(bytes);
  attempt->done = attempt->received;
  attempt->total = static_cast<uint64_t>(BytesOf(request.manifest()));
  if (attempt->progress) attempt->progress(attempt->done, attempt->total);
  if (attempt->received < attempt->total) {
    WEFT_RETURN_IF_ERROR(SendFiles(*begun, files, attempt));
  }
  v1::FinishUploadRequest finish;
  finish.set_upload_id(begun->upload_id());
  v1::LibraryItem item;
  const grpc::Status status = CallWhenAdmitted([&] {
    grpc::ClientContext context;  // no deadline: a large dump takes its time to be checked
    return stub_->FinishUpload(&context, finish, &item);
  });
  if (!status.ok()) return connection_.Explain(status);
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
  int losses = 0;
  for (int tries = 1;; ++tries) {
    Attempt attempt{progress};
    absl::StatusOr<v1::LibraryItem> item = UploadOnce(request, files, &attempt);
    if (item.ok() || !attempt.may_be_repeated || !IsWorthAnotherTry(item.status())) return item;
    if (absl::IsDataLoss(item.status()) && ++losses > 1) {
      return absl::DataLossError(absl::StrCat(item.status().message(), "; did they change meanwhile?"));
    }
    if (attempt.received > most) tries = 0;
    most = std::max(most, attempt.received);
    if (tries >= kMaxTries) return item;
    PauseBeforeTry(tries);
  }
}

absl::StatusOr<v1::ListItemsResponse> LibraryClient::List(v1::ItemKind kind) {
  v1::ListItemsRequest request;
  request.set_kind(kind);
  v1::ListItemsResponse all;
  do {
    WEFT_ASSIGN_OR_RETURN(
        const v1::ListItemsResponse page,
        CallDaemonOnce(connection_, *stub_, &v1::Library::Stub::ListItems, request, kLibraryPatience));
    request.set_page_token(page.next_page_token());
    all.MergeFrom(page);
  } while (!request.page_token().empty());
  all.clear_next_page_token();
  return all;
}

absl::StatusOr<v1::LibraryItem> LibraryClient::Get(v1::ItemKind kind, const std::string& item) {
  v1::GetItemRequest request;
  request.set_kind(kind);
  request.set_item(item);
  return CallDaemonOnce(connection_, *stub_, &v1::Library::Stub::GetItem, request, kLibraryPatience);
}

// Under a temporary name until its hash is known. A broken transfer goes on where it was.
absl::Status LibraryClient::FetchOne(const v1::FetchFileRequest& wanted, const v1::ItemFile& file,
                                     const std::string& path) {
  const std::string partial = path + ".partial";
  WEFT_ASSIGN_OR_RETURN(PosixFile written,
                        PosixFile::Open(partial, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW));
  v1::FetchFileRequest request = wanted;
  absl::Status status;
  for (int tries = 1;; ++tries) {
    grpc::ClientContext context;
    const int64_t before = request.offset();
    const auto stream = stub_->FetchFile(&context, request);
    absl::Status disk;
    for (v1::FileChunk chunk; disk.ok() && stream->Read(&chunk);) {
      if (chunk.offset() != request.offset()) continue;
      disk = written.WriteAt(chunk.data().data(), chunk.data().size(), static_cast<uint64_t>(chunk.offset()));
      request.set_offset(chunk.offset() + static_cast<int64_t>(chunk.data().size()));
      request.set_version(chunk.version());
      if (request.offset() > file.bytes()) disk = absl::DataLossError(absl::StrCat(path, ": is too long"));
    }
    if (!disk.ok()) context.TryCancel();
    const grpc::Status answer = stream->Finish();
    status = !disk.ok() ? disk : answer.ok() ? absl::OkStatus() : connection_.Explain(answer);
    const bool refused = RetryAfter(std::string(status.message())).has_value();
    if (!disk.ok() || !(absl::IsUnavailable(status) || refused)) break;
    if (request.offset() > before) tries = 0;
    if (tries >= kMaxTries) break;
    PauseBeforeTry(tries);
  }
  if (status.ok()) status = written.SyncData();
  if (status.ok() && !HasHash(partial, file.sha256())) {
    status = absl::DataLossError(absl::StrCat(path, ": other bytes arrived than the item has; get it again"));
  }
  std::error_code error;
  if (status.ok()) std::filesystem::rename(partial, path, error);
  if (error) status = WriteError(path, error.value());
  if (!status.ok()) std::filesystem::remove(partial, error);
  return status;
}

absl::Status LibraryClient::Fetch(const v1::LibraryItem& item, const std::string& folder,
                                  const ProgressFunction& progress) {
  WEFT_RETURN_IF_ERROR(CheckManifest(item.manifest()));
  WEFT_RETURN_IF_ERROR(CreateFolders(folder));
  std::error_code error;
  const std::string root = std::filesystem::canonical(folder, error).string();
  if (error) return absl::NotFoundError(absl::StrCat(folder, ": no such folder (", error.message(), ")"));
  v1::FetchFileRequest request;
  request.set_kind(item.kind());
  request.set_item(absl::StrCat("sha256:", item.id()));
  uint64_t done = 0;
  for (const v1::ItemFile& file : item.manifest().files()) {
    WEFT_ASSIGN_OR_RETURN(const auto place, FindPlace(root, file.path(), ConfinedFolder::IfMissing::kMake));
    const std::string path = place.folder.At(place.name);
    request.set_path(file.path());
    absl::Status status;
    if (!HasHash(path, file.sha256())) status = FetchOne(request, file, path);
    if (status.ok()) status = place.folder.Sync();
    if (!status.ok()) return place.folder.InWords(status);
    done += static_cast<uint64_t>(file.bytes());
    if (progress) progress(done, static_cast<uint64_t>(BytesOf(item.manifest())));
  }
  return absl::OkStatus();
}

absl::StatusOr<v1::DeleteItemResponse> LibraryClient::Delete(v1::ItemKind kind, const std::string& item) {
  v1::DeleteItemRequest request;
  request.set_kind(kind);
  request.set_item(item);
  return CallDaemonOnce(connection_, *stub_, &v1::Library::Stub::DeleteItem, request, kLibraryPatience);
}

}  // namespace weft
