#include "services/daemon/take_keeper.h"

#include <fcntl.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "base/host_clock.h"
#include "base/timed_id.h"
#include "capture/file/plain_text.h"
#include "services/daemon/request_check.h"
#include "services/files/atomic_file.h"
#include "services/files/json_file.h"
#include "services/files/unique_fd.h"
#include "services/recorder/recorder_files.h"
#include "services/recorder/recorder_process.h"
#include "services/recording/session_file.h"
#include "services/rpc/error_detail.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

bool TakeExists(const std::string& folder) {
  std::error_code error;
  return fs::is_directory(folder, error);
}

absl::Status NoSuchTake(const std::string& id) {
  return absl::NotFoundError(absl::StrCat("no take \"", id, "\"; ListTakes shows the takes"));
}

std::string KeepingFile(const std::string& folder) { return folder + "/keeping.json"; }

v1::TakeKeeping ReadKeeping(const std::string& folder) {
  v1::TakeKeeping keeping;
  const absl::Status status = ReadJsonFile(KeepingFile(folder), keeping);
  if (!status.ok() && !absl::IsNotFound(status)) {
    // Whoever cannot read whether it is pinned does not delete it.
    spdlog::warn("{}", EscapedText(std::string(status.message())));
    keeping.set_pinned(true);
  }
  return keeping;
}

// Newest first.
std::vector<std::string> TakesIn(const std::string& folder) {
  std::vector<std::string> ids;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    if (CheckTakeId(entry.path().filename().string()).ok()) ids.push_back(entry.path().filename().string());
  }
  std::sort(ids.rbegin(), ids.rend());  // ids begin with their time
  return ids;
}

uint64_t BytesOf(const std::string& folder) {
  uint64_t bytes = 0;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder, error)) {
    const uintmax_t size = entry.is_regular_file(error) ? entry.file_size(error) : 0;
    if (!error) bytes += size;
  }
  return bytes;
}

// A rename that a power failure does not undo.
absl::Status MoveFolder(const std::string& from, const std::string& to) {
  const std::string target_folder = fs::path(to).parent_path();
  if (absl::Status status = CreateFolders(target_folder); !status.ok()) return status;
  if (rename(from.c_str(), to.c_str()) != 0) return WriteError(to, errno);
  for (const std::string& folder : {target_folder, fs::path(from).parent_path().string()}) {
    const UniqueFd fd(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (absl::Status status = SyncFolder(fd.get(), folder); !status.ok()) return status;
  }
  return absl::OkStatus();
}

v1::RecordedTake Describe(const std::string& id, const std::string& folder, RecorderView view) {
  v1::RecordedTake take;
  take.set_id(id);
  take.set_folder(RecorderFiles(folder).take);
  take.set_recorder_lives(view.lives);
  *take.mutable_state() = std::move(view.state);
  *take.mutable_keeping() = ReadKeeping(folder);
  take.set_session_id(view.request.capture_session());
  return take;
}

absl::Status InUse(const std::string& id, const std::string& why, const std::string& remedy) {
  return FieldError(absl::StatusCode::kFailedPrecondition,
                    {"take_id", absl::StrCat("take ", id, " ", why), remedy});
}

}  // namespace

TakeKeeper::TakeKeeper(TakeKeeperOptions options)
    : options_(std::move(options)),
      background_([this](const std::stop_token& stop) { WorkInBackground(stop); }) {}

void TakeKeeper::WorkInBackground(const std::stop_token& stop) {
  for (const std::string& id : TakesIn(options_.takes_folder)) {
    if (stop.stop_requested()) return;
    const absl::StatusOr<v1::RecordedTake> take = Get(id);
    if (!take.ok()) spdlog::warn("{}", EscapedText(std::string(take.status().message())));
  }
  constexpr std::chrono::minutes kPeriod{1};
  std::mutex mutex;
  std::condition_variable_any asked;
  std::unique_lock lock(mutex);
  while (!stop.stop_requested()) {
    ClearAway();
    asked.wait_for(lock, stop, kPeriod, [] { return false; });
  }
}

std::map<std::string, std::string> TakeKeeper::UsersOfDevices() const {
  std::map<std::string, std::string> users;
  for (const std::string& id : TakesIn(options_.takes_folder)) {
    const absl::StatusOr<RecorderView> take = LookAtRecorder(FolderOf(id));
    if (!take.ok() || !take->lives) continue;
    for (const std::string& device : DevicesOf(take->request.session()))
      users[device] = absl::StrCat("take ", id);
  }
  return users;
}

absl::Status TakeKeeper::CheckCamerasAreFree(const std::string& field, const v1::Session& session) const {
  const std::map<std::string, std::string> users = UsersOfDevices();
  for (const std::string& device : DevicesOf(session)) {
    const auto user = users.find(device);
    if (user == users.end()) continue;
    return FieldError(
        absl::StatusCode::kFailedPrecondition,
        {field, absl::StrCat("camera ", device, " films ", user->second), "stop that take first"});
  }
  return absl::OkStatus();
}

absl::StatusOr<v1::RecordedTake> TakeKeeper::Start(const v1::StartTakeRequest& request) {
  if (absl::Status status = CheckKey(request.idempotency_key()); !status.ok()) return status;
  const std::lock_guard lock(starting_);
  std::string id = request.idempotency_key();
  if (id.empty()) id = NewTimedId();
  const std::string folder = FolderOf(id);
  if (const absl::StatusOr<RecorderView> known = LookAtRecorder(folder); known.ok()) {
    if (known->request.SerializeAsString() == request.recording().SerializeAsString()) return Get(id);
    return FieldError(absl::StatusCode::kAlreadyExists,
                      {"idempotency_key", absl::StrCat("take ", id, " was started with another request"),
                       "choose a new key"});
  }
  if (TakeExists(TrashOf(id))) {
    return FieldError(absl::StatusCode::kAlreadyExists,
                      {"idempotency_key", absl::StrCat("take ", id, " is in the trash"), "choose a new key"});
  }
  if (absl::Status status = CheckCamerasAreFree("recording.session.cameras", request.recording().session());
      !status.ok()) {
    return status;
  }
  if (absl::Status status = CreateFolders(folder); !status.ok()) return status;
  if (absl::Status status = StartRecorder(options_.recorder_program, folder, request.recording());
      !status.ok()) {
    std::error_code ignored;
    fs::remove_all(folder, ignored);  // nothing was recorded
    return status;
  }
  spdlog::info("take {} is recorded to {}", id, RecorderFiles(folder).take);
  return Get(id);
}

absl::StatusOr<v1::RecordedTake> TakeKeeper::Get(const std::string& id) {
  const std::lock_guard lock(changing_);
  return GetLocked(id);
}

absl::StatusOr<v1::RecordedTake> TakeKeeper::GetLocked(const std::string& id) {
  if (absl::Status status = CheckTakeId(id); !status.ok()) return status;
  if (!TakeExists(FolderOf(id))) {
    if (!TakeExists(TrashOf(id))) return NoSuchTake(id);
    return FieldError(absl::StatusCode::kNotFound, {"take_id", absl::StrCat("take ", id, " is in the trash"),
                                                    "RestoreTake brings it back"});
  }
  absl::StatusOr<RecorderView> view = RecoverIfDead(FolderOf(id));
  if (!view.ok()) return view.status();
  return Describe(id, FolderOf(id), *std::move(view));
}

absl::StatusOr<v1::RecordedTake> TakeKeeper::Stop(const std::string& id) {
  const absl::StatusOr<v1::RecordedTake> known = Get(id);
  if (!known.ok()) return known;
  if (absl::Status status = StopRecorder(FolderOf(id)); !status.ok()) return status;
  return Get(id);
}

v1::ListTakesResponse TakeKeeper::List(size_t limit, bool trash) {
  v1::ListTakesResponse response;
  for (const std::string& id : TakesIn(trash ? options_.trash_folder : options_.takes_folder)) {
    if (static_cast<size_t>(response.takes_size()) == limit) break;
    absl::StatusOr<v1::RecordedTake> take;
    if (trash) {
      absl::StatusOr<RecorderView> view = LookAtRecorder(TrashOf(id));
      if (view.ok())
        take = Describe(id, TrashOf(id), *std::move(view));
      else
        take = view.status();
    } else {
      take = Get(id);
    }
    if (take.ok()) {
      *response.add_takes() = *std::move(take);
    } else {
      response.add_warnings(EscapedText(std::string(take.status().message())));
    }
  }
  return response;
}

absl::StatusOr<v1::RecordedTake> TakeKeeper::Pin(const std::string& id, bool pinned) {
  const std::lock_guard lock(changing_);
  absl::StatusOr<v1::RecordedTake> take = GetLocked(id);
  if (!take.ok()) return take;
  take->mutable_keeping()->set_pinned(pinned);
  if (absl::Status status = WriteJsonFile(KeepingFile(FolderOf(id)), take->keeping()); !status.ok())
    return status;
  return take;
}

absl::StatusOr<v1::RecordedTake> TakeKeeper::Delete(const std::string& id, const std::string& because) {
  const std::lock_guard lock(changing_);
  absl::StatusOr<v1::RecordedTake> take = GetLocked(id);
  if (!take.ok()) return take;
  if (take->recorder_lives()) return InUse(id, "is being recorded", "stop it first");
  if (take->keeping().pinned()) return InUse(id, "is pinned", "unpin it first");
  if (options_.is_read(take->folder())) return InUse(id, "is read by a job", "wait for the job or cancel it");
  take->mutable_keeping()->set_deleted_unix_ns(HostTime_ns());
  take->mutable_keeping()->set_deleted_because(because);
  // A kill in between leaves a take that is there and says that it was deleted: Restore is for it, too.
  if (absl::Status status = WriteJsonFile(KeepingFile(FolderOf(id)), take->keeping()); !status.ok())
    return status;
  if (absl::Status status = MoveFolder(FolderOf(id), TrashOf(id)); !status.ok()) return status;
  take->set_folder(RecorderFiles(TrashOf(id)).take);
  spdlog::info("take {} is in the trash: {}", id, EscapedText(because));
  return take;
}

absl::StatusOr<v1::RecordedTake> TakeKeeper::Restore(const std::string& id) {
  if (absl::Status status = CheckTakeId(id); !status.ok()) return status;
  const std::lock_guard lock(changing_);
  if (TakeExists(TrashOf(id))) {
    if (TakeExists(FolderOf(id))) return InUse(id, "is there, and another of its name in the trash", "");
    if (absl::Status status = MoveFolder(TrashOf(id), FolderOf(id)); !status.ok()) return status;
  }
  absl::StatusOr<v1::RecordedTake> take = GetLocked(id);
  if (!take.ok()) return take;
  take->mutable_keeping()->clear_deleted_unix_ns();
  take->mutable_keeping()->clear_deleted_because();
  if (absl::Status status = WriteJsonFile(KeepingFile(FolderOf(id)), take->keeping()); !status.ok())
    return status;
  return take;
}

absl::StatusOr<v1::EmptyTrashResponse> TakeKeeper::EmptyTrash(const std::string& id) {
  std::vector<std::string> ids = {id};
  if (id.empty()) {
    ids = TakesIn(options_.trash_folder);
  } else if (absl::Status status = CheckTakeId(id); !status.ok()) {
    return status;
  }
  const std::lock_guard lock(changing_);
  v1::EmptyTrashResponse response;
  for (const std::string& one : ids) {
    const std::string folder = TrashOf(one);
    if (!TakeExists(folder)) {
      return FieldError(absl::StatusCode::kNotFound,
                        {"take_id", absl::StrCat("no take ", one, " in the trash"), "delete it first"});
    }
    const uint64_t bytes = BytesOf(folder);
    std::error_code error;
    fs::remove_all(folder, error);
    if (error) return WriteError(folder, error.value());
    response.set_takes(response.takes() + 1);
    response.set_bytes(response.bytes() + bytes);
    spdlog::info("take {} is removed for good", one);
  }
  return response;
}

void TakeKeeper::ClearAway() {
  std::vector<KeptTake> takes;
  const v1::ListTakesResponse list = List(SIZE_MAX, false);
  for (const v1::RecordedTake& take : list.takes()) {
    const bool kept = take.recorder_lives() || take.keeping().pinned() || options_.is_read(take.folder());
    takes.push_back({take.id(), take.state().updated_unix_ns(), 0, BytesOf(FolderOf(take.id())), kept});
  }
  // Whatever lies in the trash, also what a removal that was killed left of a take.
  for (const std::string& id : TakesIn(options_.trash_folder)) {
    const int64_t deleted_unix_ns = std::max<int64_t>(1, ReadKeeping(TrashOf(id)).deleted_unix_ns());
    takes.push_back({id, 0, deleted_unix_ns, BytesOf(TrashOf(id)), false});
  }
  std::error_code error;
  const fs::space_info space = fs::space(options_.takes_folder, error);
  const uint64_t free_bytes = error ? UINT64_MAX : space.available;
  for (const RetentionStep& step : PlanRetention(options_.retention, takes, free_bytes, HostTime_ns())) {
    const absl::Status status =
        step.remove ? EmptyTrash(step.id).status() : Delete(step.id, step.because).status();
    if (!status.ok()) {
      spdlog::warn("take {}: {}", step.id, EscapedText(std::string(status.message())));
    } else {
      spdlog::info("take {} was cleared away: {}", step.id, step.because);
    }
  }
}

absl::StatusOr<std::string> TakeOfName(const std::string& takes_folder, const std::string& name) {
  absl::string_view id = name;
  if (!absl::ConsumePrefix(&id, "take:")) return name;
  if (absl::Status status = CheckTakeId(std::string(id)); !status.ok()) return status;
  return RecorderFiles(absl::StrCat(takes_folder, "/", id)).take;
}

}  // namespace weft
