#include "services/server/library/library.h"

#include <stdio.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "base/host_clock.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "capture/file/plain_text.h"
#include "capture/file/posix_file.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/work/items/check_item.h"
#include "services/work/items/item_words.h"
#include "services/work/items/manifest.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr v1::ItemKind kItemKinds[] = {v1::ITEM_KIND_RIG,  v1::ITEM_KIND_BOARD,  v1::ITEM_KIND_TEMPLATE,
                                       v1::ITEM_KIND_DUMP, v1::ITEM_KIND_AVATAR, v1::ITEM_KIND_GARMENT};

const v1::ItemName* NameIn(const v1::LibraryItem& item, const std::string& name) {
  const v1::ItemName* newest = nullptr;
  for (const v1::ItemName& known : item.names()) {
    if (known.name() == name && (newest == nullptr || known.version() > newest->version())) newest = &known;
  }
  return newest;
}

absl::Status DamagedItem(const std::string& folder, const std::string& why) {
  return absl::DataLossError(absl::StrCat(folder, ": ", why, "; delete the item and upload it again"));
}

// "shirt@1, shirt@2".
std::string NamesOf(const std::vector<v1::LibraryItem>& items) {
  constexpr size_t kMostNamed = 20;
  std::vector<std::string> names;
  for (const v1::LibraryItem& item : items) {
    for (const v1::ItemName& name : item.names())
      names.push_back(absl::StrCat(name.name(), "@", name.version()));
  }
  if (names.empty()) return "none yet";
  const size_t more = names.size() > kMostNamed ? names.size() - kMostNamed : 0;
  names.resize(names.size() - more);
  return absl::StrCat(absl::StrJoin(names, ", "), more > 0 ? absl::StrCat(" and ", more, " more") : "");
}

// Every file has its size. Hashes were checked when it came.
absl::Status CheckFilesThere(const v1::LibraryItem& item, const std::string& content) {
  for (const v1::ItemFile& file : item.manifest().files()) {
    struct stat info;
    const std::string path = absl::StrCat(content, "/", file.path());
    if (lstat(path.c_str(), &info) != 0) return DamagedItem(path, "is missing");
    if (!S_ISREG(info.st_mode) || info.st_size != file.bytes()) {
      return DamagedItem(path, absl::StrCat("has ", info.st_size, " bytes instead of ", file.bytes()));
    }
  }
  return absl::OkStatus();
}

absl::Status Rename(const std::string& from, const std::string& to) {
  if (rename(from.c_str(), to.c_str()) != 0) return FileError(to, "cannot be made", errno);
  WEFT_RETURN_IF_ERROR(SyncFolder(fs::path(to).parent_path().string()));
  return SyncFolder(fs::path(from).parent_path().string());
}

}  // namespace

std::string PlaceInList(const v1::LibraryItem& item) {
  const v1::ItemName first = item.names().empty() ? v1::ItemName() : item.names(0);
  // Names have no character before a space, so that a name comes before those that it begins.
  return absl::StrFormat("%d %s %010d %s", static_cast<int>(item.kind()), first.name(), first.version(),
                         item.id());
}

absl::StatusOr<std::unique_ptr<Library>> Library::Open(const std::string& state_folder) {
  for (const v1::ItemKind kind : kItemKinds) {
    WEFT_RETURN_IF_ERROR(CreateFolders(absl::StrCat(state_folder, "/library/", ItemKindWord(kind))));
  }
  WEFT_RETURN_IF_ERROR(CreateFolders(state_folder + "/uploads"));
  return std::unique_ptr<Library>(new Library(state_folder));
}

std::string Library::ItemFolder(v1::ItemKind kind, const std::string& id) const {
  return absl::StrCat(state_folder_, "/library/", ItemKindWord(kind), "/", id);
}

std::string Library::ContentFolder(v1::ItemKind kind, const std::string& id) const {
  return ItemFolder(kind, id) + "/content";
}

absl::StatusOr<v1::LibraryItem> Library::ReadItem(v1::ItemKind kind, const std::string& id) const {
  const std::string folder = ItemFolder(kind, id);
  v1::LibraryItem item;
  if (absl::Status status = ReadJsonFile(folder + "/item.json", item); !status.ok()) {
    return DamagedItem(folder, std::string(status.message()));
  }
  if (item.kind() != kind || item.id() != id) return DamagedItem(folder + "/item.json", "is of another item");
  for (const v1::ItemName& name : item.names()) {
    if (absl::Status status = CheckItemName(name.name()); !status.ok()) {
      return DamagedItem(folder + "/item.json", std::string(status.message()));
    }
  }
  return item;
}

absl::Status Library::ListKind(v1::ItemKind kind, Listing* listing) const {
  std::error_code error;
  const fs::path folder = fs::path(ItemFolder(kind, ""));
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    const std::string id = entry->path().filename().string();
    if (!IsSha256(id)) {
      listing->damaged.push_back(
          absl::StrCat(EscapedText(entry->path().string()), ": is no item; remove it"));
      continue;
    }
    absl::StatusOr<v1::LibraryItem> item = ReadItem(kind, id);
    if (!item.ok()) {
      listing->damaged.push_back(EscapedText(std::string(item.status().message())));
    } else {
      listing->items.push_back(*std::move(item));
    }
  }
  if (!error) return absl::OkStatus();
  return absl::UnavailableError(absl::StrCat(folder.string(), ": cannot be listed (", error.message(), ")"));
}

absl::StatusOr<Library::Listing> Library::List(v1::ItemKind kind) const {
  const MutexLock lock(mutex_);
  Listing listing;
  for (const v1::ItemKind one : kItemKinds) {
    if (kind != v1::ITEM_KIND_UNSPECIFIED && kind != one) continue;
    WEFT_RETURN_IF_ERROR(ListKind(one, &listing));
  }
  std::ranges::sort(listing.items,
                    [](const auto& a, const auto& b) { return PlaceInList(a) < PlaceInList(b); });
  std::ranges::sort(listing.damaged);
  return listing;
}

absl::StatusOr<v1::LibraryItem> Library::FindHeader(v1::ItemKind kind, const std::string& text) const {
  WEFT_RETURN_IF_ERROR(CheckItemKind(kind));
  WEFT_ASSIGN_OR_RETURN(const ItemReference reference, ParseItemReference(text));
  if (!reference.id.empty() && PathExists(ItemFolder(kind, reference.id))) {
    return ReadItem(kind, reference.id);
  }
  Listing listing;
  WEFT_RETURN_IF_ERROR(ListKind(kind, &listing));
  const v1::LibraryItem* found = nullptr;
  int newest = 0;
  for (const v1::LibraryItem& item : listing.items) {
    for (const v1::ItemName& name : item.names()) {
      if (reference.name.empty() || name.name() != reference.name || name.version() <= newest) continue;
      if (reference.version && name.version() != *reference.version) continue;
      found = &item;
      newest = name.version();
    }
  }
  if (found != nullptr) return *found;
  return absl::NotFoundError(absl::StrCat("the library has no ", ItemKindWord(kind), " \"", text,
                                          "\"; it has ", NamesOf(listing.items),
                                          listing.damaged.empty() ? "" : ", and damaged ones"));
}

absl::StatusOr<v1::LibraryItem> Library::FindLocked(v1::ItemKind kind, const std::string& reference) const {
  WEFT_ASSIGN_OR_RETURN(v1::LibraryItem item, FindHeader(kind, reference));
  const std::string path = ItemFolder(kind, item.id()) + "/manifest.json";
  if (absl::Status status = ReadJsonFile(path, *item.mutable_manifest()); !status.ok()) {
    return DamagedItem(path, std::string(status.message()));
  }
  if (!CheckManifest(item.manifest()).ok() || ItemIdOf(item.manifest()) != item.id()) {
    return DamagedItem(path, "does not fit the item's id");
  }
  return item;
}

absl::StatusOr<v1::LibraryItem> Library::Find(v1::ItemKind kind, const std::string& reference) const {
  const MutexLock lock(mutex_);
  return FindLocked(kind, reference);
}

absl::StatusOr<HeldItem> Library::Hold(v1::ItemKind kind, const std::string& reference) {
  const MutexLock lock(mutex_);
  WEFT_ASSIGN_OR_RETURN(v1::LibraryItem item, FindLocked(kind, reference));
  const std::string content = ContentFolder(kind, item.id());
  WEFT_RETURN_IF_ERROR(CheckFilesThere(item, content));
  std::weak_ptr<const void>& known = holds_[item.id()];
  std::shared_ptr<const void> hold = known.lock();
  if (!hold) known = hold = std::make_shared<int>(0);
  std::string path = InputPathOf(kind, item.manifest(), content);
  return HeldItem{std::move(item), std::move(path), std::move(hold)};
}

absl::StatusOr<v1::ItemName> Library::NextName(v1::ItemKind kind, const std::string& name) const {
  Listing listing;
  WEFT_RETURN_IF_ERROR(ListKind(kind, &listing));
  v1::ItemName next;
  next.set_name(name);
  next.set_version(1);
  next.set_created_unix_ns(HostTime_ns());
  for (const v1::LibraryItem& item : listing.items) {
    if (const v1::ItemName* known = NameIn(item, name)) {
      next.set_version(std::max(next.version(), known->version() + 1));
    }
  }
  return next;
}

absl::StatusOr<v1::LibraryItem> Library::AddNameLocked(v1::ItemKind kind, const std::string& id,
                                                       const std::string& name) {
  WEFT_ASSIGN_OR_RETURN(v1::LibraryItem item, FindLocked(kind, "sha256:" + id));
  WEFT_RETURN_IF_ERROR(CheckFilesThere(item, ContentFolder(kind, id)));
  if (NameIn(item, name) != nullptr) return item;
  WEFT_ASSIGN_OR_RETURN(*item.add_names(), NextName(kind, name));
  v1::LibraryItem header = item;
  header.clear_manifest();
  WEFT_RETURN_IF_ERROR(WriteJsonFile(ItemFolder(kind, id) + "/item.json", header));
  return item;
}

absl::StatusOr<v1::LibraryItem> Library::AddName(v1::ItemKind kind, const std::string& id,
                                                 const std::string& name) {
  const MutexLock lock(mutex_);
  return AddNameLocked(kind, id, name);
}

absl::StatusOr<v1::LibraryItem> Library::TakeIn(const v1::ItemUpload& upload, const std::string& folder) {
  const MutexLock lock(mutex_);
  const std::string id = ItemIdOf(upload.manifest());
  absl::StatusOr<v1::LibraryItem> known = AddNameLocked(upload.kind(), id, upload.name());
  if (known.ok()) return known;
  if (absl::IsDataLoss(known.status())) {
    v1::LibraryItem damaged;
    damaged.set_kind(upload.kind());
    damaged.set_id(id);
    WEFT_RETURN_IF_ERROR(RemoveItem(damaged));
  } else if (!absl::IsNotFound(known.status())) {
    return known;
  }
  WEFT_ASSIGN_OR_RETURN(const v1::ItemName name, NextName(upload.kind(), upload.name()));
  v1::LibraryItem item;
  item.set_kind(upload.kind());
  item.set_id(id);
  item.set_bytes(BytesOf(upload.manifest()));
  item.set_file_count(upload.manifest().files_size());
  *item.add_names() = name;
  WEFT_RETURN_IF_ERROR(WriteJsonFile(folder + "/manifest.json", upload.manifest()));
  WEFT_RETURN_IF_ERROR(WriteJsonFile(folder + "/item.json", item));
  WEFT_RETURN_IF_ERROR(Rename(folder, ItemFolder(upload.kind(), id)));
  *item.mutable_manifest() = upload.manifest();
  return item;
}

// Out of the way at once, then removed; the next start removes what is left.
absl::Status Library::RemoveItem(const v1::LibraryItem& item) {
  const std::string aside = absl::StrCat(state_folder_, "/uploads/deleted-", item.id(), "-", HostTime_ns());
  WEFT_RETURN_IF_ERROR(Rename(ItemFolder(item.kind(), item.id()), aside));
  RemoveTree(aside);
  return absl::OkStatus();
}

absl::StatusOr<Library::Deletion> Library::Delete(
    v1::ItemKind kind, const std::string& text,
    const std::function<absl::Status(const v1::LibraryItem&)>& check) {
  const MutexLock lock(mutex_);
  absl::StatusOr<v1::LibraryItem> item = FindHeader(kind, text);
  const absl::StatusOr<ItemReference> reference = ParseItemReference(text);
  if (absl::IsDataLoss(item.status()) && reference.ok()) {  // damaged, and asked for by its id
    item = v1::LibraryItem();
    item->set_kind(kind);
    item->set_id(reference->id);
  }
  if (!item.ok()) return item.status();
  if (!reference->name.empty() && item->names_size() > 1) {
    v1::LibraryItem rest = *item;
    const v1::ItemName* newest = NameIn(*item, reference->name);
    const int version = reference->version.value_or(newest->version());
    rest.clear_names();
    for (const v1::ItemName& name : item->names()) {
      if (name.name() != reference->name || name.version() != version) *rest.add_names() = name;
    }
    WEFT_RETURN_IF_ERROR(WriteJsonFile(ItemFolder(kind, item->id()) + "/item.json", rest));
    return Deletion{std::move(rest), false};
  }
  if (const auto held = holds_.find(item->id()); held != holds_.end() && !held->second.expired()) {
    return absl::FailedPreconditionError(
        absl::StrCat("item ", item->id(), ": a job that reads it is being prepared; try again later"));
  }
  WEFT_RETURN_IF_ERROR(check(*item));
  WEFT_RETURN_IF_ERROR(RemoveItem(*item));
  return Deletion{*std::move(item), true};
}

}  // namespace weft
