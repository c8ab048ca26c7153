// OperationQueue: what clients start, list, cancel and delete.
#include <algorithm>
#include <filesystem>
#include <map>
#include <string>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/host_clock.h"
#include "base/status_macros.h"
#include "base/timed_id.h"
#include "capture/file/plain_text.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/server/callers/fair_share.h"
#include "services/server/callers/owners.h"
#include "services/server/daemon/calls/request_check.h"
#include "services/server/daemon/work/operation_file.h"
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

// Grows with age, for people and for pages.
std::string PlaceOf(const v1::Operation& operation) {
  return absl::StrFormat("%020d-%s", operation.created_unix_ns(), operation.id());
}

// Paths become what they were resolved to, so that none is longer than it must be, nor leads elsewhere later.
// Names of takes, jobs and items stay.
v1::OperationSpec WithResolvedPaths(v1::OperationSpec spec,
                                    const std::map<std::string, std::string>& resolved) {
  for (v1::OperationInput& input : *spec.mutable_inputs()) {
    if (absl::StartsWith(input.value(), "/")) input.set_value(resolved.at(input.value()));
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

}  // namespace

absl::Status OperationQueue::NoSuchOperation(const std::string& id) {
  return FieldError(absl::StatusCode::kNotFound,
                    {"operation_id", absl::StrCat("no operation \"", EscapedText(id), "\""),
                     "`weft operation list` shows them"});
}

absl::Status OperationQueue::Write(const v1::Operation& operation) const {
  return WriteJsonFile(OperationFile(FolderOf(operation.id())), operation);
}

absl::StatusOr<v1::Operation> OperationQueue::Read(const std::string& id) const {
  v1::Operation operation;
  const absl::Status status = ReadJsonFile(OperationFile(FolderOf(id)), operation);
  if (absl::IsNotFound(status)) return NoSuchOperation(id);  // deleted meanwhile
  if (!status.ok()) return status;
  return operation;
}

absl::Status OperationQueue::CheckRoom(const v1::OperationSpec& spec, const Caller& caller) {
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

absl::StatusOr<v1::Operation> OperationQueue::Known(const Entry& entry, const v1::OperationSpec& asked,
                                                    const Caller& caller) const {
  if (!IsSameAccount(entry.operation.started_by(), caller.name)) return KeyOfSomebodyElse();
  absl::StatusOr<v1::Operation> known =
      HasEnded(entry.operation) ? Read(entry.operation.id()) : entry.operation;
  if (!known.ok() || known->spec().SerializeAsString() == asked.SerializeAsString()) return known;
  return FieldError(
      absl::StatusCode::kAlreadyExists,
      {"idempotency_key", absl::StrCat("operation ", known->id(), " was started with another request"),
       "choose a new key"});
}

absl::StatusOr<v1::Operation> OperationQueue::Start(const v1::StartOperationRequest& request,
                                                    const Caller& caller) {
  WEFT_RETURN_IF_ERROR(CheckKey(request.idempotency_key()));
  WEFT_RETURN_IF_ERROR(CheckOperationSpec(request.spec()));
  std::map<std::string, std::string> paths;
  WEFT_ASSIGN_OR_RETURN(
      std::vector<std::string> resolved,
      ArgumentsOf(request.spec(), [&](const std::string& field, v1::ItemKind item, const std::string& value) {
        absl::StatusOr<std::string> path = options_.resolve(field, item, value);
        if (path.ok()) paths[value] = *path;
        return path;
      }));
  const v1::OperationSpec spec = WithResolvedPaths(request.spec(), paths);
  const Lock lock(mutex_);
  const std::string id = request.idempotency_key().empty() ? NewTimedId() : request.idempotency_key();
  if (const auto known = entries_.find(id); known != entries_.end())
    return Known(known->second, spec, caller);
  if (FindOperationKind(spec.command())->out() == v1::WORK_OUT_TAKE && options_.take_exists(id)) {
    return FieldError(absl::StatusCode::kAlreadyExists,
                      {"idempotency_key", absl::StrCat("is the id of take ", id), "choose a new key"});
  }
  WEFT_RETURN_IF_ERROR(options_.admit());
  WEFT_RETURN_IF_ERROR(CheckRoom(spec, caller));
  Entry entry;
  entry.inputs = std::move(resolved);
  entry.operation.set_id(id);
  entry.operation.set_started_by(caller.name);
  entry.operation.set_about(AboutOf(spec));
  *entry.operation.mutable_spec() = spec;
  entry.operation.set_state(v1::JOB_STATE_QUEUED);
  entry.operation.set_created_unix_ns(HostTime_ns());
  absl::Status kept = CreateFolders(FolderOf(id));
  if (kept.ok()) kept = Write(entry.operation);
  if (!kept.ok()) {
    std::error_code error;
    fs::remove_all(FolderOf(id), error);
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
    const auto found = entries_.find(id);
    if (found == entries_.end()) return NoSuchOperation(id);
    if (!HasEnded(found->second.operation)) return found->second.operation;
  }
  return Read(id);
}

void OperationQueue::Shorten(Entry& entry) {
  // Of a version that did not tell.
  if (entry.operation.about().empty()) entry.operation.set_about(AboutOf(entry.operation.spec()));
  KeepShort(entry.operation);
  entry.inputs = {};
}

std::vector<const OperationQueue::Entry*> OperationQueue::ByAge() const {
  std::vector<const Entry*> entries;
  for (const auto& [id, entry] : entries_) entries.push_back(&entry);
  std::sort(entries.begin(), entries.end(), [](const Entry* a, const Entry* b) {
    return std::pair(a->operation.created_unix_ns(), a->operation.id()) <
           std::pair(b->operation.created_unix_ns(), b->operation.id());
  });
  return entries;
}

absl::StatusOr<v1::ListOperationsResponse> OperationQueue::List(size_t limit, const std::string& page_token) {
  WEFT_RETURN_IF_ERROR(CheckPageToken(page_token));
  const Lock lock(mutex_);
  v1::ListOperationsResponse response;
  if (page_token.empty()) response.mutable_warnings()->Assign(warnings_.begin(), warnings_.end());
  Page page(limit);
  const std::vector<const Entry*> entries = ByAge();
  for (auto entry = entries.rbegin(); entry != entries.rend(); ++entry) {
    if (!page_token.empty() && PlaceOf((*entry)->operation) >= page_token) continue;
    v1::Operation operation = (*entry)->operation;
    KeepShort(operation);
    if (!page.Add(operation.ByteSizeLong())) {
      response.set_next_page_token(PlaceOf(*response.operations().rbegin()));
      break;
    }
    *response.add_operations() = std::move(operation);
  }
  return response;
}

absl::StatusOr<v1::Operation> OperationQueue::Cancel(const std::string& id, const Caller& caller) {
  {
    const Lock lock(mutex_);
    const auto found = entries_.find(id);
    if (found == entries_.end()) return NoSuchOperation(id);
    Entry& entry = found->second;
    WEFT_RETURN_IF_ERROR(
        CheckMayChange(caller, "operation_id", absl::StrCat("operation ", id), entry.operation.started_by()));
    if (entry.operation.state() == v1::JOB_STATE_QUEUED) {
      v1::Operation cancelled = entry.operation;
      cancelled.set_state(v1::JOB_STATE_CANCELLED);
      cancelled.set_finished_unix_ns(HostTime_ns());
      WEFT_RETURN_IF_ERROR(Write(cancelled));
      entry.operation = std::move(cancelled);
      Shorten(entry);
    }
    if (entry.operation.finished_unix_ns() == 0) entry.cancelled = true;
    changed_.notify_all();
  }
  return Get(id);
}

absl::StatusOr<v1::Operation> OperationQueue::Delete(const std::string& id, const Caller& caller) {
  v1::Operation deleted;
  {
    const Lock lock(mutex_);
    const auto found = entries_.find(id);
    if (found == entries_.end()) return NoSuchOperation(id);
    deleted = found->second.operation;
    WEFT_RETURN_IF_ERROR(
        CheckMayChange(caller, "operation_id", absl::StrCat("operation ", id), deleted.started_by()));
    if (deleted.finished_unix_ns() == 0) {
      return FieldError(absl::StatusCode::kFailedPrecondition,
                        {"operation_id", absl::StrCat("operation ", id, " has not ended"),
                         "wait for it, or cancel it first"});
    }
    WEFT_RETURN_IF_ERROR(Disown(id));
    entries_.erase(found);
  }
  std::error_code ignored;
  fs::remove_all(FolderOf(id), ignored);
  return deleted;
}

}  // namespace weft
