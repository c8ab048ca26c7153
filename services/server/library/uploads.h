// Items that are on their way into the library, below <state>/uploads/<upload id>.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/mutex.h"
#include "services/ground/process/unique_fd.h"
#include "services/server/callers/caller.h"
#include "services/server/callers/turn_gate.h"
#include "services/server/library/library.h"
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

  // Of the disk; uploads leave as much free. From now on.
  void SetLeastFree(uint64_t bytes) { least_free_bytes_ = bytes; }

  // Whoever sends the same again goes on with their own upload alone.
  absl::StatusOr<v1::BeginUploadResponse> Begin(const v1::BeginUploadRequest& request, const Caller& caller);
  absl::StatusOr<v1::LibraryItem> Finish(const std::string& upload_id, const Caller& caller);

  // What has begun and is not finished.
  struct Unfinished {
    std::string upload_id;
    int64_t last_piece_unix_ns = 0;
    uint64_t bytes = 0;  // that came
  };
  std::vector<Unfinished> ListUnfinished() const;
  // FailedPrecondition: pieces come, or came since then.
  absl::Status Abandon(const std::string& upload_id, int64_t last_piece_unix_ns);

 private:
  friend class UploadWriter;
  struct Upload;
  std::string FolderOf(const std::string& upload_id) const;
  // Deleted items that still lie there, and what a kill left of an upload that began.
  void RemoveRemains();
  // PermissionDenied: it is somebody else's.
  absl::StatusOr<std::shared_ptr<Upload>> Find(const std::string& upload_id, const Caller& caller);
  absl::StatusOr<std::shared_ptr<Upload>> FindAnybodys(const std::string& upload_id);
  std::shared_ptr<Upload> Know(const std::string& upload_id, v1::ItemUpload what)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // ResourceExhausted: the caller has too many, or too much to come.
  absl::Status CheckShare(const std::string& upload_id, int64_t bytes, const Caller& caller) const
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  struct Room {
    int64_t free_bytes = 0, spare_bytes = 0;
  };
  absl::StatusOr<Room> RoomOnDisk() const;
  // ResourceExhausted: the disk has no room for so many more bytes.
  absl::Status CheckRoom(const char* field, int64_t more_bytes) const;
  // What the uploads that go on have still to come.
  int64_t BytesToCome(const std::string& but_of) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::Status CheckFiles(Upload& upload);

  Library& library_;
  const std::string state_folder_;
  const ItemCheck check_;
  TurnGate checking_{3, 1};  // content may take long to read
  std::atomic<uint64_t> least_free_bytes_ = 0;
  Mutex mutex_;
  std::map<std::string, std::shared_ptr<Upload>> uploads_ ABSL_GUARDED_BY(mutex_);
  struct Begun {
    std::string caller;
    int64_t bytes = 0;  // of the manifest
  };
  std::map<std::string, Begun> begun_ ABSL_GUARDED_BY(mutex_);  // and not finished, by id
};

// Pieces of one call. Thread safety: none.
class UploadWriter {
 public:
  UploadWriter(Uploads& uploads, Caller caller) : uploads_(uploads), caller_(std::move(caller)) {}
  absl::Status Add(const v1::WriteFileRequest& piece);
  // All pieces are on the disk; how many bytes they had.
  absl::StatusOr<int64_t> Sync();

 private:
  absl::Status OpenFile(const std::string& path);

  Uploads& uploads_;
  const Caller caller_;
  std::string upload_id_, path_;
  std::shared_ptr<Uploads::Upload> upload_;
  UniqueFd file_;
  int64_t declared_bytes_ = 0, written_bytes_ = 0;
};

}  // namespace weft
