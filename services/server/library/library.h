// The items that clients uploaded, below <state>/library/<kind>/<id>.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/mutex.h"
#include "weft/v1/library_item.pb.h"

namespace weft {

// An item that is not deleted while `hold` lives.
struct HeldItem {
  v1::LibraryItem item;  // with its manifest
  std::string path;      // what a job gives to the readers
  std::shared_ptr<const void> hold;
};

// The folders are the truth: an item is there as soon as its folder has its name. Thread safety: any thread
// may call any function.
class Library {
 public:
  // Makes the folders where they are missing. Errors of CreateFolders.
  static absl::StatusOr<std::unique_ptr<Library>> Open(const std::string& state_folder);

  struct Listing {
    std::vector<v1::LibraryItem> items;  // by kind, name and version, without manifests
    std::vector<std::string> damaged;    // what cannot be read, and what to do
  };
  // Unspecified: all kinds. Sorted by PlaceInList.
  absl::StatusOr<Listing> List(v1::ItemKind kind) const;

  // With its manifest. `reference`: NAME (newest version), NAME@VERSION or sha256:HEX. InvalidArgument: none
  // of them. NotFound lists what there is. DataLoss: damaged.
  absl::StatusOr<v1::LibraryItem> Find(v1::ItemKind kind, const std::string& reference) const;
  // The same; also looks whether all files are there.
  absl::StatusOr<HeldItem> Hold(v1::ItemKind kind, const std::string& reference);
  // Of the item's files.
  std::string ContentFolder(v1::ItemKind kind, const std::string& id) const;

  // Gives the item a further name: its newest version, unless it has the name already.
  absl::StatusOr<v1::LibraryItem> AddName(v1::ItemKind kind, const std::string& id, const std::string& name);
  // Takes in a folder of <state>/uploads that holds content/, all of it flushed. The same content that is
  // there stays; a damaged one is replaced.
  absl::StatusOr<v1::LibraryItem> TakeIn(const v1::ItemUpload& upload, const std::string& folder);

  struct Deletion {
    v1::LibraryItem item;
    bool content_deleted = false;
  };
  // The name that `reference` gives, and the content with its last name. `check` is asked before content is
  // deleted. FailedPrecondition: a job that is being prepared holds it.
  absl::StatusOr<Deletion> Delete(v1::ItemKind kind, const std::string& reference,
                                  const std::function<absl::Status(const v1::LibraryItem&)>& check);

 private:
  explicit Library(std::string state_folder) : state_folder_(std::move(state_folder)) {}
  std::string ItemFolder(v1::ItemKind kind, const std::string& id) const;
  absl::StatusOr<v1::LibraryItem> ReadItem(v1::ItemKind kind, const std::string& id) const
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::Status ListKind(v1::ItemKind kind, Listing* listing) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::StatusOr<v1::LibraryItem> FindHeader(v1::ItemKind kind, const std::string& reference) const
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::StatusOr<v1::LibraryItem> FindLocked(v1::ItemKind kind, const std::string& reference) const
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::StatusOr<v1::ItemName> NextName(v1::ItemKind kind, const std::string& name) const
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::StatusOr<v1::LibraryItem> AddNameLocked(v1::ItemKind kind, const std::string& id,
                                                const std::string& name)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::Status RemoveItem(const v1::LibraryItem& item) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const std::string state_folder_;
  mutable Mutex mutex_;  // of the items' files, too
  std::map<std::string, std::weak_ptr<const void>> holds_ ABSL_GUARDED_BY(mutex_);  // by id
};

// By kind, name, version and id; the names of items sort as their places do.
std::string PlaceInList(const v1::LibraryItem& item);

}  // namespace weft
