#include "services/daemon/take_keeper.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <random>
#include <set>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/strip.h"
#include "base/host_clock.h"
#include "capture/file/plain_text.h"
#include "services/daemon/request_check.h"
#include "services/files/atomic_file.h"
#include "services/recorder/recorder_files.h"
#include "services/recorder/recorder_process.h"
#include "services/rpc/error_detail.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

const std::string& DeviceOf(const v1::SessionCamera& camera) {
  return camera.has_gige() ? camera.gige().device() : camera.v4l2().device();
}

std::set<std::string> DevicesOf(const v1::Session& session) {
  std::set<std::string> devices;
  for (const v1::SessionCamera& camera : session.cameras()) devices.insert(DeviceOf(camera));
  return devices;
}

absl::Status NoSuchTake(const std::string& id) {
  return absl::NotFoundError(absl::StrCat("no take \"", id, "\"; ListTakes shows the takes"));
}

}  // namespace

TakeKeeper::TakeKeeper(std::string takes_folder, std::string recorder_program)
    : takes_folder_(std::move(takes_folder)),
      recorder_program_(std::move(recorder_program)),
      recovery_([this](const std::stop_token& stop) {
        for (const std::string& id : Ids()) {
          if (stop.stop_requested()) return;
          const absl::StatusOr<v1::RecordedTake> take = Get(id);
          if (!take.ok()) spdlog::warn("{}", EscapedText(std::string(take.status().message())));
        }
      }) {}

std::vector<std::string> TakeKeeper::Ids() const {
  std::vector<std::string> ids;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(takes_folder_, error)) {
    if (CheckTakeId(entry.path().filename().string()).ok()) ids.push_back(entry.path().filename().string());
  }
  std::sort(ids.rbegin(), ids.rend());  // ids begin with their time
  return ids;
}

absl::Status TakeKeeper::CheckCamerasAreFree(const v1::Session& session) {
  const std::set<std::string> wanted = DevicesOf(session);
  for (const std::string& id : Ids()) {
    const absl::StatusOr<RecorderView> other = LookAtRecorder(FolderOf(id));
    if (!other.ok() || !other->lives) continue;
    for (const std::string& device : DevicesOf(other->request.session())) {
      if (!wanted.contains(device)) continue;
      return FieldError(absl::StatusCode::kFailedPrecondition,
                        {"recording.session.cameras", absl::StrCat("camera ", device, " films take ", id),
                         "stop that take first"});
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<v1::RecordedTake> TakeKeeper::Start(const v1::StartTakeRequest& request) {
  if (absl::Status status = CheckKey(request.idempotency_key()); !status.ok()) return status;
  const std::lock_guard lock(starting_);
  std::string id = request.idempotency_key();
  if (id.empty()) id = absl::StrCat(UtcFileName(), "-", absl::StrFormat("%08x", std::random_device()()));
  const std::string folder = FolderOf(id);
  if (const absl::StatusOr<RecorderView> known = LookAtRecorder(folder); known.ok()) {
    if (known->request.SerializeAsString() == request.recording().SerializeAsString()) return Get(id);
    return FieldError(absl::StatusCode::kAlreadyExists,
                      {"idempotency_key", absl::StrCat("take ", id, " was started with another request"),
                       "choose a new key"});
  }
  if (absl::Status status = CheckCamerasAreFree(request.recording().session()); !status.ok()) return status;
  if (absl::Status status = CreateFolders(folder); !status.ok()) return status;
  if (absl::Status status = StartRecorder(recorder_program_, folder, request.recording()); !status.ok()) {
    std::error_code ignored;
    fs::remove_all(folder, ignored);  // nothing was recorded
    return status;
  }
  spdlog::info("take {} is recorded to {}", id, RecorderFiles(folder).take);
  return Get(id);
}

absl::StatusOr<v1::RecordedTake> TakeKeeper::Get(const std::string& id) {
  if (absl::Status status = CheckTakeId(id); !status.ok()) return status;
  const std::string folder = FolderOf(id);
  std::error_code error;
  if (!fs::is_directory(folder, error)) return NoSuchTake(id);
  absl::StatusOr<RecorderView> view;
  {
    const std::lock_guard lock(recovering_);
    view = RecoverIfDead(folder);
  }
  if (!view.ok()) return view.status();
  v1::RecordedTake take;
  take.set_id(id);
  take.set_folder(RecorderFiles(folder).take);
  take.set_recorder_lives(view->lives);
  *take.mutable_state() = std::move(view->state);
  return take;
}

absl::StatusOr<v1::RecordedTake> TakeKeeper::Stop(const std::string& id) {
  const absl::StatusOr<v1::RecordedTake> known = Get(id);
  if (!known.ok()) return known;
  if (absl::Status status = StopRecorder(FolderOf(id)); !status.ok()) return status;
  return Get(id);
}

v1::ListTakesResponse TakeKeeper::List(size_t limit) {
  v1::ListTakesResponse response;
  for (const std::string& id : Ids()) {
    if (static_cast<size_t>(response.takes_size()) == limit) break;
    absl::StatusOr<v1::RecordedTake> take = Get(id);
    if (take.ok()) {
      *response.add_takes() = *std::move(take);
    } else {
      response.add_warnings(EscapedText(std::string(take.status().message())));
    }
  }
  return response;
}

absl::StatusOr<std::string> TakeOfName(const std::string& takes_folder, const std::string& name) {
  absl::string_view id = name;
  if (!absl::ConsumePrefix(&id, "take:")) return name;
  if (absl::Status status = CheckTakeId(std::string(id)); !status.ok()) return status;
  return RecorderFiles(absl::StrCat(takes_folder, "/", id)).take;
}

}  // namespace weft
