#include "services/server/catalogue/job_records.h"

#include <algorithm>
#include <filesystem>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "base/whole_file.h"
#include "capture/file/checksum.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/little_endian.h"
#include "services/server/catalogue/message_text.h"

namespace weft {

namespace fs = std::filesystem;

absl::Status JobRecords::Write(v1::JobUpdate record, Flush flush) const {
  EscapeTexts(record);
  const std::string message = record.SerializeAsString();
  std::string bytes;
  PutLittleEndian(Checksum(message.data(), message.size()), bytes);
  if (!IsFolder(folder_)) WEFT_RETURN_IF_ERROR(CreateFolders(folder_));
  const std::string path = PathOf(record.job().id());
  if (flush == Flush::kToDisk) return WriteFileAtomically(path, bytes + message);
  const int error = ReplaceWholeFile(path, bytes + message, 0666, flush);
  return error == 0 ? absl::OkStatus() : WriteError(path, error);
}

absl::Status JobRecords::Remove(const std::string& job_id) const {
  std::error_code error;
  fs::remove(PathOf(job_id), error);
  return error ? WriteError(PathOf(job_id), error.value()) : absl::OkStatus();
}

absl::StatusOr<v1::JobUpdate> JobRecords::Read(const std::string& job_id) const {
  WEFT_ASSIGN_OR_RETURN(const std::string bytes, ReadWholeFile(PathOf(job_id)));
  std::string_view message = bytes;
  v1::JobUpdate record;
  if (message.size() < sizeof(uint64_t) ||
      TakeLittleEndian<uint64_t>(message) != Checksum(message.data(), message.size()) ||
      !record.ParseFromArray(message.data(), static_cast<int>(message.size())) || record.job().id() != job_id)
    return absl::DataLossError(absl::StrCat(PathOf(job_id), ": damaged"));
  return record;
}

std::vector<std::string> JobRecords::JobIds() const {
  std::vector<std::string> ids;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_, error)) {
    const std::string name = entry.path().filename();
    if (!IsTemporaryName(name)) ids.push_back(name);
  }
  return ids;
}

int64_t EndOf(const v1::Job& job) {
  if (job.state() == v1::JOB_STATE_QUEUED || job.state() == v1::JOB_STATE_RUNNING) return 0;
  return std::max<int64_t>(1, job.finished_unix_ns());
}

v1::JobUpdate RecordOf(const v1::Job& job, const std::vector<v1::FrameInfo>& frames) {
  v1::JobUpdate record;
  *record.mutable_job() = job;
  record.mutable_frames()->Assign(frames.begin(), frames.end());
  return record;
}

}  // namespace weft
