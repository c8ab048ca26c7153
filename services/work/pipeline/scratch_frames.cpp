#include "services/work/pipeline/scratch_frames.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <system_error>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "base/error_reason.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "capture/file/posix_file.h"
#include "services/formats/files/atomic_file.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr char kPrefix[] = "weft-scratch-", kLockName[] = "lock";

UniqueFd OpenLock(const std::string& path, int flags) {
  return UniqueFd(open(path.c_str(), flags | O_CLOEXEC | O_NOFOLLOW, 0666));
}

// Under the lock of the folder nobody makes a new one, so that one without a living owner is left over.
void RemoveLeftovers(const std::string& folder) {
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    const std::string path = it->path().string();
    if (!absl::StartsWith(it->path().filename().string(), kPrefix) || !it->is_directory(error)) continue;
    const UniqueFd lock = OpenLock(absl::StrCat(path, "/", kLockName), O_RDONLY);
    if (lock.open() && flock(lock.get(), LOCK_EX | LOCK_NB) != 0) continue;
    std::error_code ignored;  // of another user
    fs::remove_all(path, ignored);
  }
}

absl::Status CopyBytes(const PosixFile& from, const StoredView& view, PosixFile& to) {
  constexpr uint64_t kPiece = uint64_t{1} << 20;
  std::string piece(std::min(view.bytes, kPiece), '\0');
  for (uint64_t done = 0; done < view.bytes; done += piece.size()) {
    piece.resize(std::min(view.bytes - done, kPiece));
    if (!from.ReadAt(piece.data(), piece.size(), view.offset_bytes + done).ok())
      return absl::DataLossError("cannot be read");
    WEFT_RETURN_IF_ERROR(to.WriteAt(piece.data(), piece.size(), done));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::unique_ptr<ScratchFrames>> ScratchFrames::Create(std::unique_ptr<FrameSource> shared,
                                                                     size_t cameras, ScratchOptions options) {
  WEFT_RETURN_IF_ERROR(CreateFolders(options.folder));
  const std::string gate = absl::StrCat(options.folder, "/weft-scratch.lock");
  UniqueFd open_gate = OpenLock(gate, O_RDWR | O_CREAT);
  if (!open_gate.open()) open_gate = OpenLock(gate, O_RDONLY);  // of another user
  if (!open_gate.open()) return WriteError(gate, errno);
  while (flock(open_gate.get(), LOCK_EX) != 0) {
    if (errno != EINTR) return WriteError(gate, errno);
  }
  RemoveLeftovers(options.folder);
  std::string folder = absl::StrCat(options.folder, "/", kPrefix, "XXXXXX");
  if (mkdtemp(folder.data()) == nullptr) return WriteError(options.folder, errno);
  UniqueFd lock = OpenLock(absl::StrCat(folder, "/", kLockName), O_RDWR | O_CREAT);
  if (!lock.open() || flock(lock.get(), LOCK_EX | LOCK_NB) != 0) {
    const int error = errno;
    RemoveTree(folder);
    return WriteError(folder, error);
  }
  return std::unique_ptr<ScratchFrames>(
      new ScratchFrames(std::move(shared), cameras, std::move(options), std::move(folder), std::move(lock)));
}

ScratchFrames::ScratchFrames(std::unique_ptr<FrameSource> shared, size_t cameras, ScratchOptions options,
                             std::string folder, UniqueFd lock)
    : shared_(std::move(shared)),
      cameras_(cameras),
      options_(std::move(options)),
      folder_(std::move(folder)),
      lock_(std::move(lock)) {}

ScratchFrames::~ScratchFrames() {
  if (copied_ahead_.valid()) copied_ahead_.wait();
  RemoveTree(folder_);
}

uint64_t ScratchFrames::bytes_held() const {
  const MutexLock lock(mutex_);
  uint64_t bytes = 0;
  for (const auto& [frame, views] : copies_) {
    for (const auto& [camera, copy] : views) bytes += copy.from.bytes;
  }
  return bytes;
}

ScratchFrames::Views ScratchFrames::ViewsOf(size_t index) const {
  Views found;
  for (size_t camera = 0; camera < cameras_; ++camera) {
    absl::StatusOr<StoredView> view = shared_->Locate(index, camera);
    if (!view.ok()) continue;
    found.bytes += view->bytes;
    found.views.emplace_back(camera, *std::move(view));
  }
  return found;
}

absl::Status ScratchFrames::CopyFrame(size_t index, const Views& views) {
  for (const auto& [camera, view] : views.views) {
    const absl::StatusOr<PosixFile> from = PosixFile::Open(view.file, O_RDONLY);
    if (!from.ok()) continue;
    const std::string path = absl::StrCat(folder_, "/", index, "-", camera);
    WEFT_ASSIGN_OR_RETURN(PosixFile to, PosixFile::Open(path, O_WRONLY | O_CREAT | O_TRUNC));
    const absl::Status copied = CopyBytes(*from, view, to);
    if (!copied.ok()) {
      unlink(path.c_str());
      if (absl::IsDataLoss(copied)) continue;
      return copied;
    }
    const MutexLock lock(mutex_);
    copies_[index][camera] = {path, view};
  }
  return absl::OkStatus();
}

void ScratchFrames::Drop(size_t index) {
  std::map<size_t, Copy> copies;
  {
    const MutexLock lock(mutex_);
    copies.swap(copies_[index]);
    copies_.erase(index);
  }
  for (const auto& [camera, copy] : copies) unlink(copy.path.c_str());
}

absl::Status ScratchFrames::Hold(size_t index, std::optional<size_t> next) {
  absl::Status status;
  bool is_held = false;
  if (copied_ahead_.valid()) {
    status = copied_ahead_.get();
    is_held = ahead_ == index;
    if (!is_held) Drop(*ahead_);
  }
  std::vector<size_t> others;
  {
    const MutexLock lock(mutex_);
    for (const auto& [frame, views] : copies_) {
      if (frame != index) others.push_back(frame);
    }
  }
  for (const size_t frame : others) Drop(frame);
  const Views own = ViewsOf(index);
  if (own.bytes > options_.quota_bytes) {
    constexpr double kMib = 1 << 20;
    return absl::FailedPreconditionError(absl::StrCat(
        "frame ", frame_names()[index], ": its images take ", static_cast<double>(own.bytes) / kMib,
        " MiB, and the quota of ", options_.folder, " is ", static_cast<double>(options_.quota_bytes) / kMib,
        " MiB; raise --slurm-scratch-mib of weftd"));
  }
  // What did not fit beside the frame before may fit now.
  if (!is_held || !status.ok()) status = CopyFrame(index, own);
  if (!status.ok()) {
    Drop(index);
    return status;
  }
  if (!next) return status;
  Views following = ViewsOf(*next);
  if (own.bytes + following.bytes > options_.quota_bytes) return status;
  ahead_ = next;
  copied_ahead_ = std::async(std::launch::async, [this, frame = *next, following = std::move(following)] {
    absl::Status copied = CopyFrame(frame, following);
    if (!copied.ok()) Drop(frame);
    return copied;
  });
  return status;
}

absl::StatusOr<Frame> ScratchFrames::ReadView(size_t index, size_t camera) const {
  std::optional<Copy> copy;
  {
    const MutexLock lock(mutex_);
    const auto frame = copies_.find(index);
    if (frame != copies_.end()) {
      if (const auto found = frame->second.find(camera); found != frame->second.end()) copy = found->second;
    }
  }
  if (!copy) return shared_->ReadView(index, camera);
  absl::StatusOr<Frame> read = shared_->ReadCopy(copy->path, index, camera);
  if (read.ok()) return read;
  // Reports name what the user knows, and are the same without copies.
  return WithMessage(read.status(),
                     absl::StrReplaceAll(read.status().message(), {{copy->path, copy->from.file}}));
}

}  // namespace weft
