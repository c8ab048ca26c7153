#include "capture/take_writer.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/statvfs.h>

#include <cerrno>
#include <filesystem>
#include <set>

#include "absl/strings/str_cat.h"
#include "capture/take_files.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

absl::Status CheckCameras(const std::vector<std::string>& camera_ids) {
  if (camera_ids.empty()) return absl::InvalidArgumentError("a take needs at least one camera");
  std::set<std::string> seen;
  for (const std::string& id : camera_ids) {
    if (absl::Status status = CheckCameraId(id); !status.ok()) return status;
    if (!seen.insert(id).second) {
      return absl::InvalidArgumentError(absl::StrCat("camera id ", id, " occurs twice; ids must be unique"));
    }
  }
  return absl::OkStatus();
}

absl::Status MakeFolder(const std::string& folder) {
  if (IsRecordedTake(folder)) {
    return absl::AlreadyExistsError(
        absl::StrCat(folder, ": holds a take; choose another folder, takes are kept"));
  }
  std::error_code error;
  fs::create_directories(StreamFolder(folder), error);
  return error ? FileError(folder, "cannot be made", error.value()) : absl::OkStatus();
}

}  // namespace

absl::StatusOr<PosixFile> OpenLockedLedger(const std::string& take, int flags) {
  absl::StatusOr<PosixFile> ledger = PosixFile::Open(LedgerFile(take), flags);
  if (!ledger.ok()) return ledger;
  if (flock(ledger->descriptor(), LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return ledger;
  return absl::FailedPreconditionError(
      absl::StrCat(take, ": is being written by another process; wait for its end"));
}

absl::StatusOr<std::unique_ptr<TakeWriter>> TakeWriter::Create(const std::string& folder,
                                                               const std::vector<std::string>& camera_ids,
                                                               const TakeWriterOptions& options) {
  if (absl::Status status = CheckCameras(camera_ids); !status.ok()) return status;
  if (absl::Status status = options.stream.Validate(); !status.ok()) return status;
  if (absl::Status status = MakeFolder(folder); !status.ok()) return status;
  absl::StatusOr<PosixFile> ledger = OpenLockedLedger(folder, O_RDWR | O_CREAT | O_EXCL);
  if (!ledger.ok()) return ledger.status();
  auto take = std::unique_ptr<TakeWriter>(new TakeWriter(*std::move(ledger), camera_ids));
  const std::string heading = LedgerHeading();
  if (absl::Status status = take->ledger_.WriteAt(heading.data(), heading.size(), 0); !status.ok())
    return status;
  take->ledger_bytes_ = heading.size();
  for (const std::string& id : camera_ids) {
    auto stream = StreamWriter::Create(StreamFolder(folder), {options.take, id}, options.stream);
    if (!stream.ok()) return stream.status();
    take->streams_.push_back(*std::move(stream));
  }
  return take;
}

absl::Status TakeWriter::Append(size_t camera, const RawFrameSet& set) {
  const std::string& id = camera_ids_[camera];
  for (const RawFrame& frame : set.frames)
    if (frame.camera_id == id) return streams_[camera]->Append(set.number, frame);
  for (const MissingFrame& missing : set.missing)
    if (missing.camera_id == id)
      return streams_[camera]->AppendMissing(set.number, set.device_time_ns, missing.reason);
  return absl::InvalidArgumentError(absl::StrCat("set ", set.number, " does not account for camera ", id));
}

absl::Status TakeWriter::AppendToLedger(const std::vector<LedgerEntry>& entries) {
  if (entries.empty()) return absl::OkStatus();
  std::string text;
  for (const LedgerEntry& entry : entries) text += ToCsvLine(entry);
  if (absl::Status status = ledger_.WriteAt(text.data(), text.size(), ledger_bytes_); !status.ok())
    return status;
  ledger_bytes_ += text.size();
  return ledger_.SyncData();
}

absl::Status TakeWriter::Commit(std::optional<uint64_t> last_set, const std::vector<LedgerEntry>& entries) {
  if (last_set) {
    for (const auto& stream : streams_)
      if (absl::Status status = stream->Commit(*last_set); !status.ok()) return status;
  }
  return AppendToLedger(entries);
}

absl::Status TakeWriter::Close(std::optional<uint64_t> last_set, const std::vector<LedgerEntry>& entries) {
  absl::Status status;
  for (const auto& stream : streams_) status.Update(stream->Close(last_set));
  status.Update(AppendToLedger(entries));
  return status;
}

absl::StatusOr<uint64_t> TakeWriter::FreeBytes() const {
  struct statvfs info {};
  if (fstatvfs(ledger_.descriptor(), &info) != 0)
    return FileError(ledger_.path(), "the disk has no size", errno);
  return static_cast<uint64_t>(info.f_bavail) * info.f_frsize;
}

std::vector<LedgerEntry> EntriesOfRecorded(const RawFrameSet& set, int64_t host_time_ns) {
  std::vector<LedgerEntry> entries;
  entries.push_back(
      {LedgerEvent::kRecorded, set.number, set.number, set.device_time_ns, host_time_ns, "", ""});
  for (const MissingFrame& missing : set.missing) {
    entries.push_back({LedgerEvent::kMissing, set.number, set.number, set.device_time_ns, host_time_ns,
                       missing.camera_id, missing.reason});
  }
  return entries;
}

}  // namespace weft
