// OperationQueue: what clients start, list, cancel, delete and fetch.
#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>
#include <string>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "base/host_clock.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "base/timed_id.h"
#include "capture/file/plain_text.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/server/callers/fair_share.h"
#include "services/server/callers/owners.h"
#include "services/server/daemon/calls/request_check.h"
#include "services/server/daemon/work/operation_queue.h"
#include "services/server/rpc/error_detail.h"
#include "services/server/rpc/page.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

// Of those that have not ended. One is worked on at a time, and all are kept in memory.
constexpr ShareLimits kWaiting{.all = 1000, .of_one_caller = 300, .reserve = 50};
constexpr ShareLimits kWaitingBytes{.all = 256 << 20, .of_one_caller = 64 << 20, .reserve = 32 << 20};
constexpr size_t kLongestAbout_bytes = 200;

// Paths become what they were resolved to, so that none is longer than it must be, nor leads elsewhere later.
// Names of takes, jobs and items stay.
v1::OperationSpec WithResolvedPaths(v1::OperationSpec spec, const std::vector<std::string>& resolved) {
  for (int i = 0; i < spec.inputs_size(); ++i) {
    v1::OperationInput& input = *spec.mutable_inputs(i);
    if (absl::StartsWith(input.value(), "/")) input.set_value(resolved[static_cast<size_t>(i)]);
  }
  return spec;
}

std::string AboutOf(const v1::OperationSpec& spec) {
  if (spec.inputs().empty()) return "";
  const std::string& first = spec.inputs(0).value();
  // The end of a path tells more, and pieces of characters are no text.
  if (first.size() <= kLongestAbout_bytes) return first;
  const std::string end = first.substr(first.size() - kLongestAbout_bytes);
  return absl::StrCat("...", IsUtf8(end) ? end : EscapedText(end));
}

// Leaves out what may be long: an answer of GetOperation may have a MiB of each, a list has many.
void KeepShort(v1::Operation& operation) {
  operation.clear_output();
  operation.mutable_spec()->clear_inputs();
  operation.mutable_spec()->clear_options();
}

absl::Status NoSuchOperation(const std::string& id) {
  return FieldError(absl::StatusCode::kNotFound,
                    {"operation_id", absl::StrCat("no operation \"", EscapedText(id), "\""),
                     "`weft operation list` shows them"});
}

}  // namespace

absl::Status OperationQueue::Write(const v1::Operation& operation) const {
  return WriteJsonFile(FileOf(operation.id()), operation);
}

absl::StatusOr<v1::Operation> OperationQueue::Read(const std::string& id) const {
  v1::Operation operation;
  const absl::Status status = ReadJsonFile(FileOf(id), operation);
  if (absl::IsNotFound(status)) return NoSuchOperation(id);  // deleted meanwhile
  if (!status.ok()) return status;
  return operation;
}

absl::StatusOr<OperationQueue::Entry*> OperationQueue::Find(const std::string& id) {
  const auto found = entries_.find(id);
  if (found == entries_.end()) return NoSuchOperation(id);
  return &found->second;
}

absl::StatusOr<OperationQueue::Entry*> OperationQueue::FindOwn(const std::string& id, const Caller& caller) {
  WEFT_ASSIGN_OR_RETURN(Entry* const entry, Find(id));
  WEFT_RETURN_IF_ERROR(
      CheckMayChange(caller, "operation_id", absl::StrCat("operation ", id), entry->operation.started_by()));
  return entry;
}

absl::Status OperationQueue::CheckRoom(const v1::OperationSpec& spec, const Caller& caller) const {
  FairShare places(kWaiting, "unfinished operations"), bytes(kWaitingBytes, "bytes of unfinished operations");
  for (const auto& [id, entry] : entries_) {
    if (HasEnded(entry.operation)) continue;
    places.Take(entry.operation.started_by());
    bytes.Take(entry.operation.started_by(), static_cast<int64_t>(entry.operation.spec().ByteSizeLong()));
  }
  absl::Status status = places.Check(caller);
  status.Update(bytes.Check(caller, static_cast<int64_t>(spec.ByteSizeLong())));
  return status;
}

absl::StatusOr<v1::Operation> OperationQueue::Start(const v1::StartOperationRequest& request,
                                                    const Caller& caller) {
  WEFT_RETURN_IF_ERROR(CheckKey(request.idempotency_key()));
  WEFT_RETURN_IF_ERROR(CheckOperationSpec(request.spec()));
  WEFT_ASSIGN_OR_RETURN(OperationCommand command, CommandOf(request.spec(), options_.resolve));
  const v1::OperationSpec spec = WithResolvedPaths(request.spec(), command.inputs);
  const Lock lock(mutex_);
  const std::string id = request.idempotency_key().empty() ? NewTimedId() : request.idempotency_key();
  if (const auto found = entries_.find(id); found != entries_.end()) {
    v1::Operation known = found->second.operation;
    if (HasEnded(known)) {
      WEFT_ASSIGN_OR_RETURN(known, Read(id));
    }
    WEFT_RETURN_IF_ERROR(CheckRepeats(caller, known.started_by(),
                                      known.spec().SerializeAsString() == spec.SerializeAsString(),
                                      absl::StrCat("operation ", id, " was started")));
    return known;
  }
  if (FindOperationKind(spec.command())->out() == v1::WORK_OUT_TAKE && options_.take_exists(id)) {
    return FieldError(absl::StatusCode::kAlreadyExists,
                      {"idempotency_key", absl::StrCat("is the id of take ", id), "choose a new key"});
  }
  WEFT_RETURN_IF_ERROR(options_.admit());
  WEFT_RETURN_IF_ERROR(CheckRoom(spec, caller));
  Entry entry;
  entry.inputs = std::move(command.inputs);
  entry.operation.set_id(id);
  entry.operation.set_started_by(caller.name);
  entry.operation.set_about(AboutOf(spec));
  *entry.operation.mutable_spec() = spec;
  entry.operation.set_state(v1::JOB_STATE_QUEUED);
  entry.operation.set_created_unix_ns(HostTime_ns());
  absl::Status kept = CreateFolders(FolderOf(id));
  if (kept.ok()) kept = Write(entry.operation);
  if (!kept.ok()) {
    RemoveTree(FolderOf(id));
    return kept;
  }
  const v1::Operation started = entry.operation;
  entries_[id] = std::move(entry);
  changed_.notify_all();
  return started;
}

absl::StatusOr<v1::Operation> OperationQueue::Get(const std::string& id) {
  {
    const Lock lock(mutex_);
    WEFT_ASSIGN_OR_RETURN(const Entry* const entry, Find(id));
    if (!HasEnded(entry->operation)) return entry->operation;
  }
  return Read(id);
}

void OperationQueue::Shorten(Entry& entry) {
  // Of a version that did not tell.
  if (entry.operation.about().empty()) entry.operation.set_about(AboutOf(entry.operation.spec()));
  KeepShort(entry.operation);
  entry.inputs = {};
}

absl::StatusOr<v1::ListOperationsResponse> OperationQueue::List(size_t limit, const std::string& page_token) {
  WEFT_RETURN_IF_ERROR(CheckPageToken(page_token));
  const Lock lock(mutex_);
  v1::ListOperationsResponse response;
  if (page_token.empty()) response.mutable_warnings()->Assign(warnings_.begin(), warnings_.end());
  std::map<std::string, const Entry*, std::greater<>> newest_first;
  for (const auto& [id, entry] : entries_)
    newest_first[PlaceByAge(entry.operation.created_unix_ns(), id)] = &entry;
  const auto show = [](const Entry* entry) {
    v1::Operation operation = entry->operation;
    KeepShort(operation);
    return operation;
  };
  response.set_next_page_token(AddPage(newest_first, limit, page_token, show, response.mutable_operations()));
  return response;
}

absl::StatusOr<v1::Operation> OperationQueue::Cancel(const std::string& id, const Caller& caller) {
  {
    const Lock lock(mutex_);
    WEFT_ASSIGN_OR_RETURN(Entry* const entry, FindOwn(id, caller));
    if (entry->operation.state() == v1::JOB_STATE_QUEUED) {
      v1::Operation cancelled = entry->operation;
      cancelled.set_state(v1::JOB_STATE_CANCELLED);
      cancelled.set_finished_unix_ns(HostTime_ns());
      WEFT_RETURN_IF_ERROR(Write(cancelled));
      entry->operation = std::move(cancelled);
      Shorten(*entry);
    }
    entry->cancelled = !HasEnded(entry->operation);
    changed_.notify_all();
  }
  return Get(id);
}

absl::Status OperationQueue::Forget(const std::string& id) {
  std::error_code error;
  fs::remove(FileOf(id), error);
  if (error) return WriteError(FileOf(id), error.value());
  entries_.erase(id);
  return absl::OkStatus();
}

absl::Status OperationQueue::RemoveFiles(const std::string& id) const {
  std::error_code error;
  fs::remove_all(FolderOf(id), error);
  return error ? WriteError(FolderOf(id), error.value()) : absl::OkStatus();
}

absl::StatusOr<v1::Operation> OperationQueue::Delete(const std::string& id, const Caller& caller) {
  v1::Operation deleted;
  {
    const Lock lock(mutex_);
    WEFT_ASSIGN_OR_RETURN(const Entry* const entry, FindOwn(id, caller));
    deleted = entry->operation;
    if (!HasEnded(deleted)) {
      return FieldError(absl::StatusCode::kFailedPrecondition,
                        {"operation_id", absl::StrCat("operation ", id, " has not ended"),
                         "wait for it, or cancel it first"});
    }
    WEFT_RETURN_IF_ERROR(Forget(id));
  }
  RemoveFiles(id).IgnoreError();
  return deleted;
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
  {
    const Lock lock(mutex_);
    const absl::StatusOr<Entry*> entry = Find(id);
    if (!entry.ok() || !HasEnded((*entry)->operation) ||
        (*entry)->operation.finished_unix_ns() != finished_unix_ns)
      return absl::FailedPreconditionError("it is gone, or runs again");
    WEFT_RETURN_IF_ERROR(Forget(id));
  }
  return RemoveFiles(id);
}

// Without its file, which may be long.
absl::Status OperationQueue::CheckDone(const std::string& id) {
  const Lock lock(mutex_);
  WEFT_ASSIGN_OR_RETURN(const Entry* const entry, Find(id));
  if (entry->operation.state() == v1::JOB_STATE_DONE) return absl::OkStatus();
  return FieldError(absl::StatusCode::kFailedPrecondition,
                    {"operation_id", absl::StrCat("operation ", id, " is not done"), "wait for it"});
}

absl::StatusOr<v1::ListOperationFilesResponse> OperationQueue::Files(
    const v1::ListOperationFilesRequest& request) {
  WEFT_RETURN_IF_ERROR(CheckPageToken(request.page_token()));
  WEFT_RETURN_IF_ERROR(CheckDone(request.operation_id()));
  std::error_code error;
  const fs::path out = OutOf(request.operation_id());
  std::map<std::string, v1::OperationFile> files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(out, error)) {
    const std::string path = entry.path().lexically_relative(out);
    if (!entry.is_regular_file(error) || entry.is_symlink(error)) continue;
    files[path].set_path(path);
    files[path].set_bytes(static_cast<int64_t>(entry.file_size(error)));
  }
  v1::ListOperationFilesResponse response;
  response.set_next_page_token(AddPage(files, static_cast<size_t>(request.limit()), request.page_token(),
                                       std::identity(), response.mutable_files()));
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

bool OperationQueue::Reads(const std::string& path) {
  const Lock lock(mutex_);
  return std::ranges::any_of(entries_, [&](const auto& known) {
    return !HasEnded(known.second.operation) &&
           std::ranges::any_of(known.second.inputs, [&](const std::string& input) {
             return input == path || absl::StartsWith(input, path + "/");
           });
  });
}

}  // namespace weft
