// The Library service: uploads, lists and downloads of items.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "base/mutex.h"
#include "services/server/callers/fair_share.h"
#include "services/server/daemon/calls/file_stream.h"
#include "services/server/daemon/door/call_identity.h"
#include "services/server/daemon/work/job_queue.h"
#include "services/server/daemon/work/operation_queue.h"
#include "services/server/library/library.h"
#include "services/server/library/uploads.h"
#include "weft/v1/library.grpc.pb.h"

namespace weft {

// Errors as library.proto says. Thread safety: gRPC calls from many threads.
class LibraryService final : public v1::Library::WithCallbackMethod_FetchFile<v1::Library::Service> {
 public:
  // Queues and library must outlive the service.
  LibraryService(JobQueue& queue, OperationQueue& operations, Library& library,
                 const std::string& state_folder, ItemCheck check, FindCaller caller)
      : queue_(queue),
        operations_(operations),
        library_(library),
        uploads_(library, state_folder, std::move(check)),
        caller_(std::move(caller)) {}

  Uploads& uploads() { return uploads_; }

  grpc::Status BeginUpload(grpc::ServerContext* context, grpc::ServerReader<v1::BeginUploadRequest>* reader,
                           v1::BeginUploadResponse* response) override;
  grpc::Status WriteFile(grpc::ServerContext* context, grpc::ServerReader<v1::WriteFileRequest>* reader,
                         v1::WriteFileResponse* response) override;
  grpc::Status FinishUpload(grpc::ServerContext* context, const v1::FinishUploadRequest* request,
                            v1::LibraryItem* item) override;
  grpc::Status ListItems(grpc::ServerContext* context, const v1::ListItemsRequest* request,
                         v1::ListItemsResponse* response) override;
  grpc::Status GetItem(grpc::ServerContext* context, const v1::GetItemRequest* request,
                       v1::LibraryItem* item) override;
  grpc::ServerWriteReactor<v1::FileChunk>* FetchFile(grpc::CallbackServerContext* context,
                                                     const v1::FetchFileRequest* request) override;
  grpc::Status DeleteItem(grpc::ServerContext* context, const v1::DeleteItemRequest* request,
                          v1::DeleteItemResponse* response) override;

 private:
  // Each has a thread. So many leave enough for the calls that take none for long.
  static constexpr ShareLimits kUploadCalls{.all = 32, .of_one_caller = 8, .reserve = 4};

  // ResourceExhausted: too many run. `receive` reads from the client, tells of each
  // message, and ends the watch before it works for long.
  absl::Status Receive(grpc::ServerContext* context,
                       const std::function<absl::Status(std::optional<StallWatch>& stalls)>& receive);
  absl::StatusOr<FilePieces> OpenFile(const v1::FetchFileRequest& request);
  absl::Status CheckUnused(const v1::LibraryItem& item);

  JobQueue& queue_;
  OperationQueue& operations_;
  Library& library_;
  Uploads uploads_;
  const FindCaller caller_;
  Mutex counting_;
  FairShare upload_calls_ ABSL_GUARDED_BY(counting_){kUploadCalls, "uploads open"};
};

}  // namespace weft
