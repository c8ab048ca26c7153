#include "services/server/daemon/studio/take_store.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <filesystem>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "base/mutex.h"
#include "base/path_facts.h"
#include "base/status_code.h"
#include "base/status_macros.h"
#include "base/timed_id.h"
#include "capture/file/plain_text.h"
#include "services/formats/files/atomic_file.h"
#include "services/server/callers/owners.h"
#include "services/server/daemon/calls/request_check.h"
#include "services/server/daemon/studio/take_folder.h"
#include "services/server/rpc/error_detail.h"
#include "services/server/rpc/page.h"
#include "services/studio/recorder/recorder_files.h"
#include "services/studio/recorder/recorder_process.h"
#include "services/studio/recording/session_file.h"
#include "services/studio/recording/take_description.h"

namespace weft {
namespace {

absl::Status NoSuchTake(const std::string& id) {
  return absl::NotFoundError(absl::StrCat("no take \"", id, "\"; `weft take list` shows the takes"));
}

// What a daemon that was killed left there; its recorders end by themselves.
void RemoveOldLooks(const std::string& looks_folder) {
  for (const std::string& id : TakesIn(looks_folder)) {
    const std::string folder = absl::StrCat(looks_folder, "/", id);
    const absl::StatusOr<RecorderView> view = InspectRecorder(folder);
    if (!view.ok() || !view->lives) RemoveTree(folder);
  }
}

// Of a recorder that films for a moment; one that takes much longer is told to stop.
absl::StatusOr<RecorderView> WaitForEnd(const std::string& folder) {
  constexpr std::chrono::milliseconds kPause{50};
  constexpr int kLongestFilming = 1200, kLongestEnding = 400;  // pauses
  for (int pauses = 0;; ++pauses) {
    absl::StatusOr<RecorderView> view = RecoverIfDead(folder);
    if (!view.ok() || !view->lives) return view;
    if (pauses == kLongestFilming) {
      WEFT_RETURN_IF_ERROR(StopRecorder(folder));
    } else if (pauses > kLongestFilming + kLongestEnding) {
      return absl::DeadlineExceededError("the cameras delivered nothing, and their recorder does not end");
    }
    std::this_thread::sleep_for(kPause);
  }
}

}  // namespace

void TakeStore::Begin() {
  background_ = std::jthread([this](const std::stop_token& stop) { WorkInBackground(stop); });
}

void TakeStore::Stop() {
  background_.request_stop();
  if (background_.joinable()) background_.join();
}

void TakeStore::WorkInBackground(const std::stop_token& stop) {
  {
    const MutexLock lock(starting_);
    RemoveOldLooks(options_.looks_folder);
  }
  constexpr std::chrono::seconds kPeriod{1};
  std::set<std::string> known;
  Mutex mutex;
  std::condition_variable_any asked;
  MutexLock lock(mutex);
  while (!stop.stop_requested()) {
    CloseDead(known);
    asked.wait_for(lock, stop, kPeriod, [] { return false; });
  }
}

// `known`: those that have ended, and those of which nobody need be told once more.
void TakeStore::CloseDead(std::set<std::string>& known) {
  for (const std::string& id : TakesIn(options_.takes_folder)) {
    if (known.contains(id)) continue;
    const absl::StatusOr<v1::RecordedTake> take = Get(id);
    if (take.ok() && !take->recorder_lives()) {
      const absl::Status told = NotifyEnd(*take);
      if (told.ok()) known.insert(id);
      if (!told.ok() && known.insert(id + "!").second) {
        spdlog::warn("take {}: its end is told later: {}", id, EscapedText(std::string(told.message())));
      }
    }
    if (!take.ok() && known.insert(id + "?").second) {
      spdlog::warn("{}", EscapedText(std::string(take.status().message())));
    }
  }
}

absl::Status TakeStore::NotifyEnd(const v1::RecordedTake& take) const {
  const std::string mark = EndToldFile(FolderOf(take.id()));
  if (std::filesystem::exists(mark)) return absl::OkStatus();
  const v1::TakeKeeping& keeping = take.keeping();
  if (!keeping.slate().empty() || !keeping.name().empty() || !keeping.notes().empty()) DescribeInTake(take);
  WEFT_RETURN_IF_ERROR(options_.on_end(take));
  return WriteFileAtomically(mark, "");
}

std::map<std::string, v1::Session> TakeStore::LivingSessions() const {
  std::map<std::string, v1::Session> sessions;
  for (const std::string& id : TakesIn(options_.takes_folder)) {
    const absl::StatusOr<RecorderView> take = InspectRecorder(FolderOf(id));
    if (take.ok() && take->lives) sessions[id] = take->request.session();
  }
  return sessions;
}

std::map<std::string, std::string> TakeStore::UsersOfDevices() const {
  std::map<std::string, std::string> users;
  for (const auto& [id, session] : LivingSessions()) {
    for (const std::string& device : DevicesOf(session)) users[device] = absl::StrCat("take ", id);
  }
  return users;
}

std::set<std::string> TakeStore::ReplayedTakes() const {
  std::set<std::string> folders;
  for (const auto& [id, session] : LivingSessions()) folders.merge(ReplayedTakesOf(session));
  return folders;
}

absl::Status TakeStore::CheckCamerasAreFree(const std::string& field, const v1::Session& session) const {
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

absl::Status TakeStore::ResolveReplays(const std::string& field, v1::Session& session) const {
  for (v1::SessionCamera& camera : *session.mutable_cameras()) {
    if (!camera.has_replay()) continue;
    WEFT_ASSIGN_OR_RETURN(
        std::string take,
        options_.resolve_take(absl::StrCat(field, ".", camera.id(), ".replay.take"), camera.replay().take()));
    camera.mutable_replay()->set_take(std::move(take));
  }
  return absl::OkStatus();
}

absl::StatusOr<v1::RecordedTake> TakeStore::Start(const v1::StartTakeRequest& asked) {
  WEFT_RETURN_IF_ERROR(CheckKey(asked.idempotency_key()));
  v1::StartTakeRequest request = asked;
  WEFT_RETURN_IF_ERROR(
      ResolveReplays("recording.session.cameras", *request.mutable_recording()->mutable_session()));
  const MutexLock lock(starting_);
  std::string id = request.idempotency_key();
  if (id.empty()) id = NewTimedId();
  const std::string folder = FolderOf(id);
  if (const absl::StatusOr<RecorderView> known = InspectRecorder(folder); known.ok()) {
    const Caller caller{request.recording().started_by()};
    // One account may have several tokens.
    request.mutable_recording()->set_started_by(known->request.started_by());
    WEFT_RETURN_IF_ERROR(
        CheckRepeats(caller, known->request.started_by(),
                     known->request.SerializeAsString() == request.recording().SerializeAsString(),
                     absl::StrCat("take ", id, " was started")));
    return Get(id);
  }
  if (TakeExists(TrashOf(id))) {
    return FieldError(absl::StatusCode::kAlreadyExists,
                      {"idempotency_key", absl::StrCat("take ", id, " is in the trash"), "choose a new key"});
  }
  WEFT_RETURN_IF_ERROR(options_.admit());
  WEFT_RETURN_IF_ERROR(CheckCamerasAreFree("recording.session.cameras", request.recording().session()));
  {
    // A recorder that does not live yet is no dead one.
    const MutexLock unchanged(changing_);
    WEFT_RETURN_IF_ERROR(CreateFolders(folder));
    if (absl::Status status = StartRecorder(options_.recorder_program, folder, request.recording());
        !status.ok()) {
      RemoveTree(folder);  // nothing was recorded
      return status;
    }
  }
  spdlog::info("take {} is recorded to {}", id, RecorderFiles(folder).take);
  return Get(id);
}

absl::Status TakeStore::FilmBriefly(const v1::Session& asked,
                                    const std::function<void(const std::string& take)>& use) {
  v1::Session session = asked;
  WEFT_RETURN_IF_ERROR(ResolveReplays("cameras.cameras", session));
  const MutexLock lock(starting_);
  WEFT_RETURN_IF_ERROR(CheckCamerasAreFree("cameras.cameras", session));
  const std::string folder = absl::StrCat(options_.looks_folder, "/", NewTimedId());
  WEFT_RETURN_IF_ERROR(CreateFolders(folder));
  const absl::Cleanup remove = [&folder] { RemoveTree(folder); };
  v1::RecorderRequest request;
  *request.mutable_session() = session;
  request.set_seconds(std::max(1.0, session.fps() > 0 ? 3 / session.fps() : 0));
  request.set_no_disk_test(true);
  WEFT_RETURN_IF_ERROR(StartRecorder(options_.recorder_program, folder, request));
  WEFT_ASSIGN_OR_RETURN(const RecorderView ended, WaitForEnd(folder));
  if (ended.state.phase() != v1::RECORDER_PHASE_ENDED) {
    return absl::Status(StatusCodeOf(ended.state.error_code()), ended.state.message());
  }
  use(RecorderFiles(folder).take);
  return absl::OkStatus();
}

absl::StatusOr<v1::RecordedTake> TakeStore::Get(const std::string& id) {
  const MutexLock lock(changing_);
  return GetLocked(id);
}

absl::StatusOr<v1::RecordedTake> TakeStore::GetLocked(const std::string& id) {
  WEFT_RETURN_IF_ERROR(CheckTakeId(id));
  if (!TakeExists(FolderOf(id))) {
    if (!TakeExists(TrashOf(id))) return NoSuchTake(id);
    return FieldError(absl::StatusCode::kNotFound, {"take_id", absl::StrCat("take ", id, " is in the trash"),
                                                    "RestoreTake brings it back"});
  }
  WEFT_ASSIGN_OR_RETURN(RecorderView view, RecoverIfDead(FolderOf(id)));
  return DescribeTakeFolder(id, FolderOf(id), std::move(view));
}

absl::StatusOr<v1::RecordedTake> TakeStore::Stop(const std::string& id) {
  WEFT_RETURN_IF_ERROR(Get(id).status());
  WEFT_RETURN_IF_ERROR(StopRecorder(FolderOf(id)));
  return Get(id);
}

v1::ListTakesResponse TakeStore::List(const v1::ListTakesRequest& request, size_t limit) {
  const bool trash = request.trash();
  v1::ListTakesResponse response;
  Page page(limit);
  for (const std::string& id : TakesIn(trash ? options_.trash_folder : options_.takes_folder)) {
    if (!request.page_token().empty() && id >= request.page_token()) continue;
    absl::StatusOr<v1::RecordedTake> take;
    if (trash) {
      absl::StatusOr<RecorderView> view = InspectRecorder(TrashOf(id));
      if (view.ok())
        take = DescribeTakeFolder(id, TrashOf(id), *std::move(view));
      else
        take = view.status();
    } else {
      take = Get(id);
    }
    if (take.ok()) {
      const v1::TakeKeeping& keeping = take->keeping();
      if (!HasWords(request.words(),
                    {keeping.slate(), keeping.name(), keeping.notes(), id, take->timecode()}))
        continue;
      if (!page.Add(take->ByteSizeLong())) {
        response.set_next_page_token(response.takes().rbegin()->id());
        break;
      }
      *response.add_takes() = *std::move(take);
    } else {
      response.add_warnings(EscapedText(std::string(take.status().message())));
    }
  }
  return response;
}

}  // namespace weft
