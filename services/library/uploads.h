// Items that are on their way into the library, below <state>/uploads/<upload id>.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "services/files/unique_fd.h"
#include "services/library/library.h"
#include "weft/v1/library.pb.h"

namespace weft {

// CheckItemContent.
using ItemCheck = std::function<absl::Status(v1::ItemKind kind, const v1::ItemManifest& manifest,
                                             const std::string& folder)>;

// Errors as library.proto says. Thread safety: any thread may call any function.
class Uploads {
 public:
  // The library must outlive it.
  Uploads(Library& library, std::string state_folder, ItemCheck check);

  absl::StatusOr<v1::BeginUploadResponse> Begin(const v1::BeginUploadRequest& request);
  absl::StatusOr<v1::LibraryItem> Finish(const std::string& upload_id);

  // Uploads to which nothing came for so long, and deleted items that still lie there.
  void RemoveAbandoned(std::chrono::seconds age = std::chrono::hours(7 * 24));

 private:
  friend class UploadWriter;
  struct Upload;
  std::string FolderOf(const std::string& upload_id) const;
  absl::StatusOr<std::shared_ptr<Upload>> Find(const std::string& upload_id);
  absl::Status CheckRoom(const v1::ItemManifest& manifest, int64_t received) const;
  absl::Status CheckFiles(Upload& upload);

  Library& library_;
  const std::string state_folder_;
  const ItemCheck check_;
  std::mutex mutex_;
  std::map<std::string, std::shared_ptr<Upload>> uploads_;
};

// Pieces of one call. Thread safety: none.
class UploadWriter {
 public:
  explicit UploadWriter(Uploads& uploads) : uploads_(uploads) {}
  absl::Status Add(const v1::WriteFileRequest& piece);
  // All pieces are on the disk; how many bytes they had.
  absl::StatusOr<int64_t> Sync();

 private:
  absl::Status OpenFile(const std::string& path);

  Uploads& uploads_;
  std::string upload_id_, path_;
  std::shared_ptr<Uploads::Upload> upload_;
  UniqueFd file_;
  int64_t declared_bytes_ = 0, written_bytes_ = 0;
};

}  // namespace weft
