// What becomes of takes: adopted, pinned, deleted, restored, cleared away.
#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstdio>

#include "absl/strings/str_cat.h"
#include "base/host_clock.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "capture/file/plain_text.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/file_facts.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/moved_folder.h"
#include "services/server/daemon/calls/request_check.h"
#include "services/server/daemon/studio/take_folder.h"
#include "services/server/daemon/studio/take_store.h"
#include "services/server/rpc/error_detail.h"
#include "services/studio/recorder/recorder_files.h"
#include "services/studio/recording/take_file.h"

namespace weft {
namespace {

// When the folder was last moved or changed. 0: unknown.
int64_t ChangedAt(const std::string& folder) {
  struct stat info;
  if (stat(folder.c_str(), &info) != 0) return 0;
  return UnixTime_ns(info.st_ctim);
}

// What a removal was at that a kill ended; no take has such a name.
constexpr char kRemovedPrefix[] = ".removed-";

void RemoveRest(const std::string& trash_folder) {
  if (const absl::Status status = RemoveAside(trash_folder, kRemovedPrefix); !status.ok())
    spdlog::warn("{}", EscapedText(std::string(status.message())));
}

absl::Status InUse(const std::string& id, const std::string& why, const std::string& remedy) {
  return FieldError(absl::StatusCode::kFailedPrecondition,
                    {"take_id", absl::StrCat("take ", id, " ", why), remedy});
}

}  // namespace

absl::Status TakeStore::Adopt(const std::string& take_folder, const std::string& id,
                              const std::string& origin) {
  WEFT_RETURN_IF_ERROR(CheckTakeId(id));
  const MutexLock lock(changing_);
  if (TakeExists(FolderOf(id)) || TakeExists(TrashOf(id))) return absl::OkStatus();
  WEFT_ASSIGN_OR_RETURN(const v1::Take take, ReadTakeFile(take_folder));
  // Beside its folder, so that the last step is one rename.
  const std::string adopted = take_folder + ".adopted";
  RemoveTree(adopted);
  WEFT_RETURN_IF_ERROR(CreateFolders(adopted));
  const RecorderFiles files(adopted);
  v1::RecorderState state;
  state.set_phase(v1::RECORDER_PHASE_ENDED);
  state.set_message(origin);
  state.set_updated_unix_ns(HostTime_ns());
  state.set_sets_recorded(take.sets_recorded());
  state.set_sets_dropped(take.sets_dropped());
  state.set_frames_missing(take.frames_missing());
  state.set_disk_minutes_left(-1);
  WEFT_RETURN_IF_ERROR(WriteJsonFile(files.request, v1::RecorderRequest()));
  WEFT_RETURN_IF_ERROR(WriteJsonFile(files.state, state));
  if (rename(take_folder.c_str(), files.take.c_str()) != 0) return WriteError(files.take, errno);
  return MoveFolder(adopted, FolderOf(id));
}

absl::StatusOr<v1::RecordedTake> TakeStore::Pin(const std::string& id, bool pinned) {
  const MutexLock lock(changing_);
  WEFT_ASSIGN_OR_RETURN(v1::RecordedTake take, GetLocked(id));
  take.mutable_keeping()->set_pinned(pinned);
  WEFT_RETURN_IF_ERROR(WriteJsonFile(KeepingFile(FolderOf(id)), take.keeping()));
  return take;
}

absl::StatusOr<v1::RecordedTake> TakeStore::Describe(const v1::DescribeTakeRequest& request) {
  WEFT_RETURN_IF_ERROR(CheckDescription(request));
  const std::string& id = request.take_id();
  const MutexLock lock(changing_);
  WEFT_ASSIGN_OR_RETURN(v1::RecordedTake take, GetLocked(id));
  v1::TakeKeeping& keeping = *take.mutable_keeping();
  keeping.set_slate(request.slate());
  keeping.set_notes(request.notes());
  if (request.has_name()) keeping.set_name(request.name());
  WEFT_RETURN_IF_ERROR(WriteJsonFile(KeepingFile(FolderOf(id)), keeping));
  // Its own file too, which goes where the take goes; while it is recorded, at its end.
  if (!take.recorder_lives()) DescribeInTake(take);
  return take;
}

absl::StatusOr<v1::RecordedTake> TakeStore::Delete(const std::string& id, const std::string& because) {
  const MutexLock lock(changing_);
  WEFT_ASSIGN_OR_RETURN(v1::RecordedTake take, GetLocked(id));
  if (take.recorder_lives()) return InUse(id, "is being recorded", "stop it first");
  if (take.keeping().pinned()) return InUse(id, "is pinned", "unpin it first");
  if (options_.is_read(take.folder()) || ReplayedTakes().contains(take.folder()))
    return InUse(id, "is read by a job, an operation or a take that replays it", "wait for it or cancel it");
  take.mutable_keeping()->set_deleted_unix_ns(HostTime_ns());
  take.mutable_keeping()->set_deleted_because(because);
  // A kill in between leaves a take that is there and says that it was deleted: Restore is for it, too.
  WEFT_RETURN_IF_ERROR(WriteJsonFile(KeepingFile(FolderOf(id)), take.keeping()));
  WEFT_RETURN_IF_ERROR(MoveFolder(FolderOf(id), TrashOf(id)));
  take.set_folder(RecorderFiles(TrashOf(id)).take);
  spdlog::info("take {} is in the trash: {}", id, EscapedText(because));
  return take;
}

absl::StatusOr<v1::RecordedTake> TakeStore::Restore(const std::string& id) {
  WEFT_RETURN_IF_ERROR(CheckTakeId(id));
  const MutexLock lock(changing_);
  if (TakeExists(TrashOf(id))) {
    if (TakeExists(FolderOf(id))) return InUse(id, "is there, and another of its name in the trash", "");
    WEFT_RETURN_IF_ERROR(MoveFolder(TrashOf(id), FolderOf(id)));
  }
  WEFT_ASSIGN_OR_RETURN(v1::RecordedTake take, GetLocked(id));
  take.mutable_keeping()->clear_deleted_unix_ns();
  take.mutable_keeping()->clear_deleted_because();
  WEFT_RETURN_IF_ERROR(WriteJsonFile(KeepingFile(FolderOf(id)), take.keeping()));
  return take;
}

absl::StatusOr<v1::EmptyTrashResponse> TakeStore::EmptyTrash(const std::string& id) {
  std::vector<std::string> ids = {id};
  if (id.empty()) {
    ids = TakesIn(options_.trash_folder);
  } else if (absl::Status status = CheckTakeId(id); !status.ok()) {
    return status;
  }
  const MutexLock lock(changing_);
  v1::EmptyTrashResponse response;
  for (const std::string& one : ids) {
    const std::string folder = TrashOf(one);
    if (!TakeExists(folder)) {
      return FieldError(absl::StatusCode::kNotFound,
                        {"take_id", absl::StrCat("no take ", one, " in the trash"), "delete it first"});
    }
    const uint64_t bytes = BytesBelow(folder);
    WEFT_RETURN_IF_ERROR(PutAside(folder, kRemovedPrefix));
    response.set_takes(response.takes() + 1);
    response.set_bytes(response.bytes() + bytes);
    spdlog::info("take {} is removed for good", one);
  }
  WEFT_RETURN_IF_ERROR(RemoveAside(options_.trash_folder, kRemovedPrefix));
  return response;
}

std::vector<Holding> TakeStore::Holdings() {
  std::vector<Holding> holdings;
  const v1::ListTakesResponse list = List({}, SIZE_MAX);
  const std::set<std::string> replayed = ReplayedTakes();
  for (const v1::RecordedTake& take : list.takes()) {
    const bool kept = take.recorder_lives() || take.keeping().pinned() || replayed.contains(take.folder()) ||
                      options_.is_read(take.folder());
    holdings.push_back({v1::HOLDING_KIND_TAKE, take.id(), take.state().updated_unix_ns(),
                        BytesBelow(FolderOf(take.id())), kept});
  }
  {
    const MutexLock lock(changing_);
    RemoveRest(options_.trash_folder);
  }
  // Whatever lies in the trash, also what a removal by an earlier version left of a take.
  for (const std::string& id : TakesIn(options_.trash_folder)) {
    int64_t since_unix_ns = ReadKeeping(TrashOf(id)).deleted_unix_ns();
    if (since_unix_ns == 0) since_unix_ns = ChangedAt(TrashOf(id));
    holdings.push_back({v1::HOLDING_KIND_TRASH, id, since_unix_ns, BytesBelow(TrashOf(id)), false});
  }
  return holdings;
}

absl::Status TakeStore::Carry(const RetentionStep& step) {
  return step.to_trash ? Delete(step.id, step.because).status() : EmptyTrash(step.id).status();
}

}  // namespace weft
