// The client's side of the daemon's library.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/library/item_files.h"
#include "weft/v1/library.grpc.pb.h"

namespace weft {

// Errors keep the daemon's category and message. Broken transfers go on where they were, with pauses; they
// end as Unavailable when nothing more arrives. Thread safety: any thread may call any function.
class LibraryClient {
 public:
  using ProgressFunction = std::function<void(uint64_t done_bytes, uint64_t all_bytes)>;

  // `server` is HOST:PORT. Connects at the first call.
  explicit LibraryClient(const std::string& server);

  // Content that the daemon has already is not sent again.
  absl::StatusOr<v1::LibraryItem> Upload(v1::ItemKind kind, const std::string& name, const LocalItem& files,
                                         const ProgressFunction& progress = {});
  absl::StatusOr<v1::ListItemsResponse> List(v1::ItemKind kind);
  absl::StatusOr<v1::LibraryItem> Get(v1::ItemKind kind, const std::string& item);
  absl::StatusOr<v1::DeleteItemResponse> Delete(v1::ItemKind kind, const std::string& item);

 private:
  absl::StatusOr<v1::LibraryItem> UploadOnce(const v1::BeginUploadRequest& request, const LocalItem& files,
                                             const ProgressFunction& progress, uint64_t* received);
  absl::Status SendFile(const std::string& upload_id, const v1::ItemFile& file, const std::string& path,
                        int64_t offset, const std::function<void(size_t)>& sent);

  const std::string server_;
  const std::unique_ptr<v1::Library::Stub> stub_;
};

}  // namespace weft
