// The client's side of the daemon's library.
#pragma once

#include <functional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/tools/client/daemon_call.h"
#include "services/work/items/item_files.h"
#include "weft/v1/library.grpc.pb.h"

namespace weft {

class LibraryClient : public ServiceClient<v1::Library> {
 public:
  using ProgressFunction = std::function<void(uint64_t done_bytes, uint64_t all_bytes)>;
  using ServiceClient::ServiceClient;

  // Content that the daemon has already is not sent again, nor what arrived of an earlier upload of the same
  // files. A broken transfer goes on by itself, with pauses; Unavailable: nothing more arrives. DataLoss: the
  // files are others than `files` says.
  absl::StatusOr<v1::LibraryItem> Upload(v1::ItemKind kind, const std::string& name, const LocalItem& files,
                                         const ProgressFunction& progress = {});
  absl::StatusOr<v1::ListItemsResponse> List(v1::ItemKind kind);
  // With its manifest. `item`: NAME, NAME@VERSION or sha256:HEX.
  absl::StatusOr<v1::LibraryItem> Get(v1::ItemKind kind, const std::string& item);
  // Writes all files of an item of Get below `folder`, which is made where it is missing. Files that are
  // there with the right bytes are kept. DataLoss: bytes are others than the item's hash says.
  absl::Status Fetch(const v1::LibraryItem& item, const std::string& folder,
                     const ProgressFunction& progress = {});
  absl::StatusOr<v1::DeleteItemResponse> Delete(v1::ItemKind kind, const std::string& item);

 private:
  struct Attempt;
  absl::StatusOr<v1::LibraryItem> UploadOnce(const v1::BeginUploadRequest& request, const LocalItem& files,
                                             Attempt* attempt);
  absl::StatusOr<v1::BeginUploadResponse> Begin(const v1::BeginUploadRequest& request);
  grpc::Status SendManifest(const v1::BeginUploadRequest& request, v1::BeginUploadResponse* response);
  absl::Status SendFiles(const v1::BeginUploadResponse& begun, const LocalItem& files, Attempt* attempt);
  absl::Status FetchOne(const v1::FetchFileRequest& request, const v1::ItemFile& file,
                        const std::string& path);
};

}  // namespace weft
