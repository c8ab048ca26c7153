// The files that operations wrote.
#include <algorithm>
#include <filesystem>
#include <string>

#include "absl/strings/str_cat.h"
#include "capture/file/plain_text.h"
#include "services/daemon/operation_queue.h"
#include "services/rpc/error_detail.h"

namespace weft {

namespace fs = std::filesystem;

absl::StatusOr<v1::ListOperationFilesResponse> OperationQueue::Files(const std::string& id) {
  const absl::StatusOr<v1::Operation> operation = Get(id);
  if (!operation.ok()) return operation.status();
  if (operation->state() != v1::JOB_STATE_DONE) {
    return FieldError(absl::StatusCode::kFailedPrecondition,
                      {"operation_id", absl::StrCat("operation ", id, " is not done"), "wait for it"});
  }
  v1::ListOperationFilesResponse response;
  std::error_code error;
  const fs::path out = OutOf(id);
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(out, error)) {
    if (!entry.is_regular_file(error) || entry.is_symlink(error)) continue;
    v1::OperationFile& file = *response.add_files();
    file.set_path(entry.path().lexically_relative(out));
    file.set_bytes(static_cast<int64_t>(entry.file_size(error)));
  }
  std::sort(response.mutable_files()->begin(), response.mutable_files()->end(),
            [](const auto& a, const auto& b) { return a.path() < b.path(); });
  return response;
}

absl::StatusOr<std::string> OperationQueue::FindFile(const std::string& id, const std::string& path) {
  const absl::StatusOr<v1::ListOperationFilesResponse> files = Files(id);
  if (!files.ok()) return files.status();
  for (const v1::OperationFile& file : files->files()) {
    if (file.path() == path) return absl::StrCat(OutOf(id), "/", path);
  }
  return FieldError(absl::StatusCode::kNotFound,
                    {"path", absl::StrCat("operation ", id, " wrote no file \"", EscapedText(path), "\""),
                     "ListOperationFiles shows them"});
}

void OperationQueue::SetKeepDays(double days) {
  const Lock lock(mutex_);
  keep_days_ = days;
}

}  // namespace weft
