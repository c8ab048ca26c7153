#include "services/daemon/take_folder.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "capture/file/plain_text.h"
#include "services/daemon/request_check.h"
#include "services/files/json_file.h"
#include "services/recorder/recorder_files.h"
#include "services/recording/session_file.h"

namespace weft {

namespace fs = std::filesystem;

std::vector<std::string> TakesIn(const std::string& folder) {
  std::vector<std::string> ids;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    if (CheckTakeId(entry.path().filename().string()).ok()) ids.push_back(entry.path().filename().string());
  }
  std::sort(ids.rbegin(), ids.rend());  // ids begin with their time
  return ids;
}

bool TakeExists(const std::string& folder) {
  std::error_code error;
  return fs::is_directory(folder, error);
}

std::string EndToldFile(const std::string& folder) { return folder + "/end-told"; }

std::string KeepingFile(const std::string& folder) { return folder + "/keeping.json"; }

v1::TakeKeeping ReadKeeping(const std::string& folder) {
  v1::TakeKeeping keeping;
  const absl::Status status = ReadJsonFile(KeepingFile(folder), keeping);
  if (!status.ok() && !absl::IsNotFound(status)) {
    spdlog::warn("{}", EscapedText(std::string(status.message())));
    keeping.set_pinned(true);
  }
  return keeping;
}

v1::RecordedTake DescribeTakeFolder(const std::string& id, const std::string& folder, RecorderView view) {
  v1::RecordedTake take;
  take.set_id(id);
  take.set_folder(RecorderFiles(folder).take);
  take.set_recorder_lives(view.lives);
  *take.mutable_state() = std::move(view.state);
  *take.mutable_keeping() = ReadKeeping(folder);
  take.set_session_id(view.request.capture_session());
  return take;
}

absl::StatusOr<std::string> TakeOfName(const std::string& takes_folder, const std::string& name) {
  absl::string_view id = name;
  if (!absl::ConsumePrefix(&id, kTakePrefix)) return name;
  if (absl::Status status = CheckTakeId(std::string(id)); !status.ok()) return status;
  return RecorderFiles(absl::StrCat(takes_folder, "/", id)).take;
}

}  // namespace weft
