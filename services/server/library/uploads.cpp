#include "services/server/library/uploads.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <filesystem>
#include <unordered_map>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "base/mutex.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "capture/file/posix_file.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/file_facts.h"
#include "services/formats/files/json_file.h"
#include "services/server/callers/owners.h"
#include "services/work/items/item_path.h"
#include "services/work/items/item_words.h"
#include "services/work/items/manifest.h"
#include "services/work/items/sha256.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr int64_t kMaxPieceBytes = 512 << 10;
constexpr std::chrono::minutes kRestsAfter{2};

// Without an account: of a version that had no owners.
std::string UploadIdOf(const v1::BeginUploadRequest& request, const std::string& account) {
  return Sha256()
      .Add(absl::StrCat(ItemKindWord(request.kind()), "\n", request.name(), "\n",
                        ItemIdOf(request.manifest()), account.empty() ? "" : "\n", account))
      .Hex();
}

// An upload of a version that had no owners is the first one's who goes on with it.
// True: it was moved.
bool TakeOverOld(const std::string& old_folder, const std::string& folder) {
  std::error_code error;
  v1::ItemUpload what;
  if (old_folder == folder || fs::exists(folder, error) ||
      !ReadJsonFile(old_folder + "/upload.json", what).ok() || !what.begun_by().empty()) {
    return false;
  }
  fs::rename(old_folder, folder, error);
  return !error;
}

// 0 where there is none.
int64_t SizeOfUploaded(const std::string& content, const std::string& path) {
  struct stat info;
  if (lstat(absl::StrCat(content, "/", path).c_str(), &info) != 0 || !S_ISREG(info.st_mode)) return 0;
  return info.st_size;
}

// 0: there is no such upload.
int64_t LastPiece_unix_ns(const std::string& folder) {
  struct stat info;
  if (lstat(absl::StrCat(folder, "/upload.json").c_str(), &info) != 0) return 0;
  return UnixTime_ns(info.st_mtim);
}

}  // namespace

struct Uploads::Upload {
  v1::ItemUpload what;
  std::string folder;  // with upload.json and content/
  std::unordered_map<std::string, int64_t> sizes;
  Mutex mutex;  // of its files
  std::atomic<bool> finishing = false;
  // What has come, and when a piece last did: uploads that rest reserve no room.
  std::atomic<int64_t> received_bytes = 0;
  std::atomic<std::chrono::steady_clock::time_point> active_at = std::chrono::steady_clock::now();
  bool finished = false;  // written with the lock of the list as well, and read with either
};

Uploads::Uploads(Library& library, std::string state_folder, ItemCheck check)
    : library_(library), state_folder_(std::move(state_folder)), check_(std::move(check)) {
  RemoveRemains();
  for (const Unfinished& unfinished : ListUnfinished()) {
    v1::ItemUpload what;
    if (ReadJsonFile(FolderOf(unfinished.upload_id) + "/upload.json", what).ok())
      begun_[unfinished.upload_id] = {what.begun_by(), BytesOf(what.manifest())};
  }
}

std::string Uploads::FolderOf(const std::string& upload_id) const {
  return absl::StrCat(state_folder_, "/uploads/", upload_id);
}

void Uploads::RemoveRemains() {
  const MutexLock lock(mutex_);
  std::error_code error;
  std::vector<fs::path> remains;
  for (fs::directory_iterator entry(FolderOf(""), error), end; !error && entry != end;
       entry.increment(error)) {
    std::error_code fault;
    const bool is_deleted = absl::StartsWith(entry->path().filename().string(), "deleted-");
    if (is_deleted || (!fs::exists(entry->path() / "upload.json", fault) && !fault))
      remains.push_back(entry->path());
  }
  for (const fs::path& path : remains) fs::remove_all(path, error);
}

std::vector<Uploads::Unfinished> Uploads::ListUnfinished() const {
  std::vector<Unfinished> unfinished;
  std::error_code error;
  for (fs::directory_iterator entry(FolderOf(""), error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string id = entry->path().filename();
    const int64_t time_ns = LastPiece_unix_ns(entry->path());
    if (IsSha256(id) && time_ns != 0) unfinished.push_back({id, time_ns, BytesBelow(entry->path())});
  }
  return unfinished;
}

absl::Status Uploads::Abandon(const std::string& upload_id, int64_t last_piece_unix_ns) {
  const MutexLock lock(mutex_);
  const auto known = uploads_.find(upload_id);
  if (known != uploads_.end() && known->second.use_count() > 1)
    return absl::FailedPreconditionError("pieces of it come");
  if (LastPiece_unix_ns(FolderOf(upload_id)) != last_piece_unix_ns)
    return absl::FailedPreconditionError("more of it came");
  if (known != uploads_.end()) uploads_.erase(known);
  begun_.erase(upload_id);
  std::error_code error;
  fs::remove_all(FolderOf(upload_id), error);
  return error ? WriteError(FolderOf(upload_id), error.value()) : absl::OkStatus();
}

std::shared_ptr<Uploads::Upload> Uploads::Know(const std::string& upload_id, v1::ItemUpload what) {
  if (const auto known = uploads_.find(upload_id); known != uploads_.end()) return known->second;
  auto upload = std::make_shared<Upload>();
  upload->folder = FolderOf(upload_id);
  upload->what = std::move(what);
  for (const v1::ItemFile& file : upload->what.manifest().files()) {
    upload->sizes[file.path()] = file.bytes();
    upload->received_bytes += SizeOfUploaded(upload->folder + "/content", file.path());
  }
  return uploads_[upload_id] = upload;
}

absl::StatusOr<std::shared_ptr<Uploads::Upload>> Uploads::Find(const std::string& upload_id,
                                                               const Caller& caller) {
  WEFT_ASSIGN_OR_RETURN(std::shared_ptr<Upload> upload, FindAnybodys(upload_id));
  WEFT_RETURN_IF_ERROR(
      CheckMayChange(caller, "upload_id", absl::StrCat("upload ", upload_id), upload->what.begun_by()));
  return upload;
}

absl::StatusOr<std::shared_ptr<Uploads::Upload>> Uploads::FindAnybodys(const std::string& upload_id) {
  if (!IsSha256(upload_id)) return absl::InvalidArgumentError("upload_id: must be one of BeginUpload");
  const MutexLock lock(mutex_);
  if (const auto known = uploads_.find(upload_id); known != uploads_.end()) return known->second;
  v1::ItemUpload what;
  absl::Status status = ReadJsonFile(FolderOf(upload_id) + "/upload.json", what);
  if (status.ok()) status = CheckManifest(what.manifest());
  if (!status.ok()) {
    return absl::NotFoundError(
        absl::StrCat("upload_id: there is no upload ", upload_id, "; is it finished, or was it abandoned?"));
  }
  return Know(upload_id, std::move(what));
}

int64_t Uploads::BytesToCome(const std::string& but_of) const {
  const auto now = std::chrono::steady_clock::now();
  int64_t bytes = 0;
  for (const auto& [id, upload] : uploads_) {
    if (id == but_of || upload->finished || now - upload->active_at.load() > kRestsAfter) continue;
    bytes += std::max<int64_t>(0, BytesOf(upload->what.manifest()) - upload->received_bytes);
  }
  return bytes;
}

absl::StatusOr<v1::BeginUploadResponse> Uploads::Begin(const v1::BeginUploadRequest& request,
                                                       const Caller& caller) {
  for (const absl::Status& status :
       {CheckItemKind(request.kind()), CheckItemName(request.name()), CheckManifest(request.manifest())}) {
    if (!status.ok()) return status;
  }
  RemoveRemains();
  const MutexLock lock(mutex_);  // nothing is finished or removed meanwhile
  v1::BeginUploadResponse response;
  const absl::StatusOr<v1::LibraryItem> known =
      library_.AddName(request.kind(), ItemIdOf(request.manifest()), request.name());
  if (known.ok()) {
    *response.mutable_item() = *known;
    response.mutable_item()->clear_manifest();
    return response;
  }
  if (!absl::IsNotFound(known.status()) && !absl::IsDataLoss(known.status())) return known.status();
  response.set_upload_id(UploadIdOf(request, AccountOf(caller.name)));
  const std::string folder = FolderOf(response.upload_id());
  const std::string old_id = UploadIdOf(request, "");
  if (TakeOverOld(FolderOf(old_id), folder)) begun_.erase(old_id);
  int64_t received = 0;
  for (const v1::ItemFile& file : request.manifest().files()) {
    response.add_received_bytes(SizeOfUploaded(folder + "/content", file.path()));
    received += response.received_bytes().at(response.received_bytes_size() - 1);
  }
  WEFT_RETURN_IF_ERROR(CheckShare(response.upload_id(), BytesOf(request.manifest()) - received, caller));
  const int64_t to_come = BytesOf(request.manifest()) - received + BytesToCome(response.upload_id());
  WEFT_RETURN_IF_ERROR(CheckRoom("manifest", to_come));
  WEFT_RETURN_IF_ERROR(CreateFolders(folder + "/content"));
  v1::ItemUpload what;
  what.set_kind(request.kind());
  what.set_name(request.name());
  *what.mutable_manifest() = request.manifest();
  what.set_begun_by(caller.name);
  WEFT_RETURN_IF_ERROR(WriteJsonFile(folder + "/upload.json", what));
  begun_[response.upload_id()] = {caller.name, BytesOf(request.manifest())};
  // Known from here on, for the room that it needs.
  const std::shared_ptr<Upload> upload = Know(response.upload_id(), std::move(what));
  upload->received_bytes = received;
  upload->active_at = std::chrono::steady_clock::now();
  return response;
}

// Whole, flushed, and with the hashes that were declared.
absl::Status Uploads::CheckFiles(Upload& upload) {
  std::vector<std::string> wrong;
  for (const v1::ItemFile& file : upload.what.manifest().files()) {
    WEFT_ASSIGN_OR_RETURN(const auto place, FindPlace(upload.folder + "/content", file.path(),
                                                      ConfinedFolder::IfMissing::kMake));
    const std::string path = place.folder.At(place.name);
    const int flags = O_RDWR | O_CLOEXEC | O_NOFOLLOW | (file.bytes() == 0 ? O_CREAT : 0);
    const UniqueFd opened(open(path.c_str(), flags, 0644));
    struct stat info;
    if (!opened.open() && errno != ENOENT) return FileError(file.path(), "cannot be opened", errno);
    const int64_t there = opened.open() && fstat(opened.get(), &info) == 0 ? info.st_size : 0;
    if (there != file.bytes()) {
      return absl::FailedPreconditionError(absl::StrCat("\"", file.path(), "\": ", there, " of ",
                                                        file.bytes(), " bytes are there; upload the rest"));
    }
    const absl::StatusOr<std::string> hash = Sha256OfFile(path);
    if (!hash.ok()) return place.folder.InWords(hash.status());
    if (*hash != file.sha256()) {
      WEFT_RETURN_IF_ERROR(place.folder.Remove(place.name));
      wrong.push_back(file.path());
      continue;
    }
    if (fsync(opened.get()) != 0) return FileError(file.path(), "cannot be written", errno);
    WEFT_RETURN_IF_ERROR(place.folder.Sync());
  }
  if (wrong.empty()) return absl::OkStatus();
  return absl::DataLossError(absl::StrCat("bytes other than declared in ", absl::StrJoin(wrong, ", "),
                                          "; they were dropped, upload them again"));
}

absl::StatusOr<v1::LibraryItem> Uploads::Finish(const std::string& upload_id, const Caller& caller) {
  WEFT_ASSIGN_OR_RETURN(const std::shared_ptr<Upload> found, Find(upload_id, caller));
  Upload& upload = *found;
  const MutexLock lock(upload.mutex);
  if (upload.finished) return library_.Find(upload.what.kind(), "sha256:" + ItemIdOf(upload.what.manifest()));
  upload.finishing = true;
  absl::Status status = CheckFiles(upload);
  if (status.ok()) {
    const TurnGate::Pass pass = checking_.Enter(caller.name);
    status = check_(upload.what.kind(), upload.what.manifest(), upload.folder + "/content");
  }
  const MutexLock list_lock(mutex_);
  absl::StatusOr<v1::LibraryItem> item =
      status.ok() ? library_.TakeIn(upload.what, upload.folder) : absl::StatusOr<v1::LibraryItem>(status);
  upload.finishing = false;
  // Content that no reader accepts never will be.
  if (!item.ok() && !absl::IsInvalidArgument(item.status())) return item;
  upload.finished = item.ok();
  if (item.ok()) RemoveFile(library_.ContentFolder(item->kind(), item->id()) + "/../upload.json");
  RemoveTree(upload.folder);
  uploads_.erase(upload_id);
  begun_.erase(upload_id);
  return item;
}

absl::Status UploadWriter::OpenFile(const std::string& path) {
  const auto declared = upload_->sizes.find(path);
  if (declared == upload_->sizes.end()) {
    WEFT_RETURN_IF_ERROR(CheckItemPath(path));
    return absl::NotFoundError(absl::StrCat("path: the manifest has no file \"", path, "\""));
  }
  WEFT_ASSIGN_OR_RETURN(const auto place,
                        FindPlace(upload_->folder + "/content", path, ConfinedFolder::IfMissing::kMake));
  file_ = UniqueFd(open(place.folder.At(place.name).c_str(),
                        O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0644));
  if (!file_.open()) return FileError(path, "cannot be written", errno);
  path_ = path;
  declared_bytes_ = declared->second;
  return place.folder.Sync();
}

absl::Status UploadWriter::Add(const v1::WriteFileRequest& piece) {
  if (!piece.upload_id().empty() && piece.upload_id() != upload_id_) {
    if (upload_) return absl::InvalidArgumentError("upload_id: all pieces of a call are of one upload");
    WEFT_ASSIGN_OR_RETURN(upload_, uploads_.Find(piece.upload_id(), caller_));
    upload_id_ = piece.upload_id();
  }
  if (!upload_) return absl::InvalidArgumentError("upload_id: must not be empty");
  if (static_cast<int64_t>(piece.data().size()) > kMaxPieceBytes) {
    return absl::InvalidArgumentError(absl::StrCat("data: at most ", kMaxPieceBytes, " bytes in a piece"));
  }
  if (upload_->finishing) return absl::AbortedError("the upload is being finished");
  const MutexLock lock(upload_->mutex);
  if (upload_->finished) return absl::AbortedError("the upload is finished");
  if (!piece.path().empty() && piece.path() != path_) {
    WEFT_RETURN_IF_ERROR(Sync().status());
    WEFT_RETURN_IF_ERROR(OpenFile(piece.path()));
  }
  if (!file_.open()) return absl::InvalidArgumentError("path: must not be empty");
  struct stat info;
  if (fstat(file_.get(), &info) != 0) return FileError(path_, "cannot be looked at", errno);
  const int64_t bytes = static_cast<int64_t>(piece.data().size());
  if (piece.offset() != info.st_size || bytes > declared_bytes_ - info.st_size) {
    return absl::OutOfRangeError(absl::StrCat("\"", path_, "\": ", bytes, " bytes at ", piece.offset(),
                                              ", but ", info.st_size, " of ", declared_bytes_,
                                              " bytes are there"));
  }
  upload_->active_at = std::chrono::steady_clock::now();
  WEFT_RETURN_IF_ERROR(uploads_.CheckRoom("data", bytes));
  if (const int error = WriteAll(file_.get(), piece.data()); error != 0) {
    return FileError(path_, "cannot be written", error);
  }
  upload_->received_bytes += bytes;
  written_bytes_ += bytes;
  return absl::OkStatus();
}

absl::StatusOr<int64_t> UploadWriter::Sync() {
  if (!file_.open()) return written_bytes_;
  if (fsync(file_.get()) != 0) return FileError(path_, "cannot be written", errno);
  utimensat(AT_FDCWD, (upload_->folder + "/upload.json").c_str(), nullptr, 0);
  return written_bytes_;
}

}  // namespace weft
