#include "capture/take/take_writer.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/statvfs.h>

#include <cerrno>
#include <filesystem>
#include <set>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/take/take_files.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

absl::Status CheckCameras(const std::vector<std::string>& camera_ids) {
  if (camera_ids.empty()) return absl::InvalidArgumentError("a take needs at least one camera");
  std::set<std::string> seen;
  for (const std::string& id : camera_ids) {
    WEFT_RETURN_IF_ERROR(CheckCameraId(id));
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
  WEFT_RETURN_IF_ERROR(CheckCameras(camera_ids));
  WEFT_RETURN_IF_ERROR(options.stream.Validate());
  WEFT_RETURN_IF_ERROR(MakeFolder(folder));
  WEFT_ASSIGN_OR_RETURN(PosixFile ledger, OpenLockedLedger(folder, O_RDWR | O_CREAT | O_EXCL));
  auto take = std::unique_ptr<TakeWriter>(new TakeWriter(std::move(ledger), camera_ids));
  const std::string heading = LedgerHeading();
  WEFT_RETURN_IF_ERROR(take->ledger_.WriteAt(heading.data(), heading.size(), 0));
  take->ledger_bytes_ = heading.size();
  take->ledger_checksum_ = LedgerStart();
  for (size_t i = 0; i < camera_ids.size(); ++i) {
    const std::string description = i < options.descriptions.size() ? options.descriptions[i] : "";
    WEFT_ASSIGN_OR_RETURN(
        auto stream, StreamWriter::Create(StreamFolder(folder), {options.take, camera_ids[i], description},
                                          options.stream));
    take->streams_.push_back(std::move(stream));
  }
  WEFT_RETURN_IF_ERROR(take->SyncFolders(folder));
  return take;
}

absl::Status TakeWriter::SyncFolders(const std::string& folder) const {
  std::error_code error;
  const fs::path path = fs::absolute(folder, error).lexically_normal();
  const fs::path own = path.has_filename() ? path : path.parent_path();
  for (const std::string& each : {StreamFolder(folder), folder, own.parent_path().string()})
    WEFT_RETURN_IF_ERROR(SyncFolder(each));
  return absl::OkStatus();
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
  uint64_t checksum = ledger_checksum_;
  for (const LedgerEntry& entry : entries) text += ToCsvLine(entry, checksum);
  WEFT_RETURN_IF_ERROR(ledger_.WriteAt(text.data(), text.size(), ledger_bytes_));
  // Where this fails the same place is written again.
  WEFT_RETURN_IF_ERROR(ledger_.SyncData());
  ledger_bytes_ += text.size();
  ledger_checksum_ = checksum;
  return absl::OkStatus();
}

absl::Status TakeWriter::Commit(std::optional<uint64_t> last_set, const std::vector<LedgerEntry>& entries) {
  if (last_set) {
    for (const auto& stream : streams_) WEFT_RETURN_IF_ERROR(stream->Commit(*last_set));
  }
  WEFT_RETURN_IF_ERROR(AppendToLedger(entries));
  for (const auto& stream : streams_) stream->Keep();
  return absl::OkStatus();
}

absl::Status TakeWriter::Trim() {
  absl::Status status;
  for (const auto& stream : streams_) status.Update(stream->Trim());
  return status;
}

absl::Status TakeWriter::Close(std::optional<uint64_t> last_set, const std::vector<LedgerEntry>& entries,
                               const TakeEnd& end) {
  absl::Status status;
  for (const auto& stream : streams_) status.Update(stream->Close(last_set));
  std::vector<LedgerEntry> lines = entries;
  if (status.ok()) lines.push_back(EndEntry(end, last_set));
  // A line of an earlier try may stand beyond.
  status.Update(AppendToLedger(lines));
  status.Update(ledger_.Truncate(ledger_bytes_));
  status.Update(ledger_.SyncData());
  StreamEnd last;
  last.outcome = end.outcome;
  last.cause = end.cause;
  last.ended_host_time_ns = end.ended_host_time_ns;
  last.sets_recorded = end.sets_recorded;
  last.sets_dropped = end.sets_dropped;
  last.frames_missing = end.frames_missing;
  for (const auto& stream : streams_)
    if (status.ok()) status.Update(stream->WriteEnd(last));
  return status;
}

absl::StatusOr<uint64_t> TakeWriter::FreeBytes() const {
  struct statvfs info {};
  if (fstatvfs(ledger_.descriptor(), &info) != 0)
    return FileError(ledger_.path(), "the disk has no size", errno);
  uint64_t bytes = static_cast<uint64_t>(info.f_bavail) * info.f_frsize;
  for (const auto& stream : streams_) bytes += stream->spare_bytes();
  return bytes;
}

LedgerEntry EndEntry(const TakeEnd& end, std::optional<uint64_t> last_set) {
  const char* how = end.outcome == TakeOutcome::kComplete  ? "complete"
                    : end.outcome == TakeOutcome::kStopped ? "stopped"
                                                           : "recovered";
  return {LedgerEvent::kEnd,
          0,
          last_set.value_or(0),
          0,
          end.ended_host_time_ns,
          "",
          end.cause.empty() ? how : absl::StrCat(how, ": ", end.cause)};
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
