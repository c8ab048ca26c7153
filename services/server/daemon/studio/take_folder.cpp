#include "services/server/daemon/studio/take_folder.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>

#include "base/path_facts.h"
#include "capture/file/plain_text.h"
#include "services/formats/files/json_file.h"
#include "services/server/daemon/calls/request_check.h"
#include "services/studio/recorder/recorder_files.h"
#include "services/studio/recording/take_description.h"
#include "services/studio/recording/take_file.h"

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

bool TakeExists(const std::string& folder) { return IsFolder(folder); }

std::string EndToldFile(const std::string& folder) { return folder + "/end-told"; }

std::string KeepingFile(const std::string& folder) { return folder + "/keeping.json"; }

v1::TakeKeeping ReadKeeping(const std::string& folder) {
  v1::TakeKeeping keeping;
  const absl::Status status = ReadJsonFile(KeepingFile(folder), keeping, kSmallJson);
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
  v1::TakeKeeping& keeping = *take.mutable_keeping();
  keeping = ReadKeeping(folder);
  if (const absl::StatusOr<TakeFile> file = ReadTakeFileStrictly(take.folder()); file.ok()) {
    take.set_timecode(file->take.timecode());
    // Those that came with it, until somebody says something else.
    if (keeping.slate().empty() && keeping.name().empty() && keeping.notes().empty()) {
      keeping.set_slate(file->take.slate());
      keeping.set_name(file->take.name());
      keeping.set_notes(file->take.notes());
    }
  }
  take.set_session_id(view.request.capture_session());
  take.set_started_by(view.request.started_by());
  return take;
}

void DescribeInTake(const v1::RecordedTake& take) {
  const v1::TakeKeeping& keeping = take.keeping();
  const absl::Status status =
      DescribeTakeFile(take.folder(), {keeping.slate(), keeping.name(), keeping.notes()}).status();
  if (!status.ok()) spdlog::warn("take {}: {}", take.id(), EscapedText(std::string(status.message())));
}

}  // namespace weft
