// The files that operations wrote, and those that they may read.
#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "capture/file/plain_text.h"
#include "services/daemon/operation_queue.h"
#include "services/files/atomic_file.h"
#include "services/rpc/error_detail.h"
#include "services/rpc/operation_kinds.h"

namespace weft {

namespace fs = std::filesystem;

absl::StatusOr<v1::Operation> OperationQueue::GetDone(const std::string& id) {
  absl::StatusOr<v1::Operation> operation = Get(id);
  if (!operation.ok() || operation->state() == v1::JOB_STATE_DONE) return operation;
  return FieldError(absl::StatusCode::kFailedPrecondition,
                    {"operation_id", absl::StrCat("operation ", id, " is not done"), "wait for it"});
}

absl::StatusOr<v1::ListOperationFilesResponse> OperationQueue::Files(const std::string& id) {
  if (absl::Status status = GetDone(id).status(); !status.ok()) return status;
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

absl::StatusOr<FilePieces> OperationQueue::OpenFile(const std::string& id, const std::string& path,
                                                    const StreamStart& start) {
  if (absl::Status status = GetDone(id).status(); !status.ok()) return status;
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

absl::Status OperationQueue::ForgetEnded(const std::string& id, int64_t finished_unix_ns) {
  const Lock lock(mutex_);
  const auto found = entries_.find(id);
  if (found == entries_.end() || !HasEnded(found->second.operation) ||
      found->second.operation.finished_unix_ns() != finished_unix_ns)
    return absl::FailedPreconditionError("it is gone, or runs again");
  std::error_code error;
  fs::remove_all(FolderOf(id), error);
  if (error) return WriteError(FolderOf(id), error.value());
  entries_.erase(found);
  return absl::OkStatus();
}

std::vector<std::string> OperationQueue::ReadableOf(const v1::OperationSpec& spec,
                                                    const std::vector<std::string>& inputs) const {
  std::vector<std::string> readable = inputs;
  const auto add = [&readable](const std::vector<std::string>& paths) {
    readable.insert(readable.end(), paths.begin(), paths.end());
  };
  add(FindLinks(inputs, options_.links).others);
  if (FindOperationKind(spec.command())->reads_besides && options_.readable_besides)
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
