// The files that operations wrote, and those that they may read.
#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/file/plain_text.h"
#include "services/formats/files/atomic_file.h"
#include "services/server/daemon/calls/request_check.h"
#include "services/server/daemon/work/operation_file.h"
#include "services/server/daemon/work/operation_queue.h"
#include "services/server/rpc/error_detail.h"
#include "services/server/rpc/page.h"

namespace weft {

namespace fs = std::filesystem;

absl::Status OperationQueue::CheckDone(const std::string& id) {
  {
    // Without its file, which may be long.
    const Lock lock(mutex_);
    const auto found = entries_.find(id);
    if (found != entries_.end() && found->second.operation.state() == v1::JOB_STATE_DONE)
      return absl::OkStatus();
    if (found == entries_.end()) return NoSuchOperation(id);
  }
  return FieldError(absl::StatusCode::kFailedPrecondition,
                    {"operation_id", absl::StrCat("operation ", id, " is not done"), "wait for it"});
}

absl::StatusOr<v1::ListOperationFilesResponse> OperationQueue::Files(
    const v1::ListOperationFilesRequest& request) {
  WEFT_RETURN_IF_ERROR(CheckPageToken(request.page_token()));
  WEFT_RETURN_IF_ERROR(CheckDone(request.operation_id()));
  std::error_code error;
  const fs::path out = OutOf(request.operation_id());
  std::vector<v1::OperationFile> files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(out, error)) {
    if (!entry.is_regular_file(error) || entry.is_symlink(error)) continue;
    v1::OperationFile file;
    file.set_path(entry.path().lexically_relative(out));
    if (file.path() <= request.page_token()) continue;
    file.set_bytes(static_cast<int64_t>(entry.file_size(error)));
    files.push_back(std::move(file));
  }
  std::sort(files.begin(), files.end(), [](const auto& a, const auto& b) { return a.path() < b.path(); });
  v1::ListOperationFilesResponse response;
  Page page(static_cast<size_t>(request.limit()));
  for (v1::OperationFile& file : files) {
    if (!page.Add(file.ByteSizeLong())) {
      response.set_next_page_token(response.files().rbegin()->path());
      break;
    }
    *response.add_files() = std::move(file);
  }
  return response;
}

absl::StatusOr<FilePieces> OperationQueue::OpenFile(const std::string& id, const std::string& path,
                                                    const StreamStart& start) {
  WEFT_RETURN_IF_ERROR(CheckDone(id));
  const absl::StatusOr<ConfinedFolder> out = ConfinedFolder::Open(OutOf(id));
  absl::StatusOr<FilePieces> pieces = out.ok() ? FilePieces::Open(*out, path, start) : out.status();
  const bool is_none = absl::IsNotFound(pieces.status()) || absl::IsFailedPrecondition(pieces.status()) ||
                       absl::IsInvalidArgument(pieces.status());
  if (!is_none) return pieces;
  return FieldError(absl::StatusCode::kNotFound,
                    {"path", absl::StrCat("operation ", id, " wrote no file \"", EscapedText(path), "\""),
                     "ListOperationFiles shows them"});
}

std::vector<Holding> OperationQueue::EndedHoldings() {
  const Lock lock(mutex_);
  std::vector<Holding> holdings;
  for (const auto& [id, entry] : entries_) {
    if (HasEnded(entry.operation))
      holdings.push_back({v1::HOLDING_KIND_OPERATION, id, entry.operation.finished_unix_ns(), 0, false});
  }
  return holdings;
}

// Without its state a folder is nobody's, and the next daemon removes what is left of it.
absl::Status OperationQueue::Disown(const std::string& id) const {
  const std::string file = OperationFile(FolderOf(id));
  std::error_code error;
  fs::remove(file, error);
  return error ? WriteError(file, error.value()) : absl::OkStatus();
}

absl::Status OperationQueue::ForgetEnded(const std::string& id, int64_t finished_unix_ns) {
  {
    const Lock lock(mutex_);
    const auto found = entries_.find(id);
    if (found == entries_.end() || !HasEnded(found->second.operation) ||
        found->second.operation.finished_unix_ns() != finished_unix_ns)
      return absl::FailedPreconditionError("it is gone, or runs again");
    WEFT_RETURN_IF_ERROR(Disown(id));
    entries_.erase(found);
  }
  std::error_code error;
  fs::remove_all(FolderOf(id), error);
  return error ? WriteError(FolderOf(id), error.value()) : absl::OkStatus();
}

std::vector<std::string> OperationQueue::ReadableOf(const v1::OperationSpec& spec,
                                                    const std::vector<std::string>& inputs) const {
  std::vector<std::string> readable = inputs;
  const auto add = [&readable](const std::vector<std::string>& paths) {
    readable.insert(readable.end(), paths.begin(), paths.end());
  };
  add(FindLinks(inputs, options_.links).others);
  if (FindOperationKind(spec.command())->reads_besides() && options_.readable_besides)
    add(options_.readable_besides());
  return readable;
}

bool OperationQueue::Reads(const std::string& path) {
  const Lock lock(mutex_);
  return std::any_of(entries_.begin(), entries_.end(), [&](const auto& entry) {
    const std::vector<std::string>& inputs = entry.second.inputs;
    return entry.second.operation.finished_unix_ns() == 0 &&
           std::any_of(inputs.begin(), inputs.end(), [&](const std::string& input) {
             return input == path || absl::StartsWith(input, path + "/");
           });
  });
}

}  // namespace weft
