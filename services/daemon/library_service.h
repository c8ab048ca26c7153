// The Library service: uploads, lists and downloads of items.
#pragma once

#include <memory>
#include <string>

#include "services/daemon/job_queue.h"
#include "services/daemon/operation_queue.h"
#include "services/library/library.h"
#include "services/library/uploads.h"
#include "weft/v1/library.grpc.pb.h"

namespace weft {

// Errors as library.proto says. Thread safety: gRPC calls from many threads.
class LibraryService final : public v1::Library::Service {
 public:
  // Queues and library must outlive the service.
  LibraryService(JobQueue& queue, OperationQueue& operations, Library& library,
                 const std::string& state_folder, ItemCheck check)
      : queue_(queue),
        operations_(operations),
        library_(library),
        uploads_(library, state_folder, std::move(check)) {}

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
  grpc::Status FetchFile(grpc::ServerContext* context, const v1::FetchFileRequest* request,
                         grpc::ServerWriter<v1::FileChunk>* writer) override;
  grpc::Status DeleteItem(grpc::ServerContext* context, const v1::DeleteItemRequest* request,
                          v1::DeleteItemResponse* response) override;

 private:
  absl::Status Fetch(const v1::FetchFileRequest& request, grpc::ServerWriter<v1::FileChunk>& writer);
  absl::Status CheckUnused(const v1::LibraryItem& item);

  JobQueue& queue_;
  OperationQueue& operations_;
  Library& library_;
  Uploads uploads_;
};

}  // namespace weft
