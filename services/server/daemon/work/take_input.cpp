#include "services/server/daemon/work/take_input.h"

#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "base/status_macros.h"
#include "services/server/daemon/calls/request_check.h"
#include "services/studio/recorder/recorder_files.h"
#include "services/studio/recording/session_file.h"

namespace weft {

absl::StatusOr<std::string> TakeOfName(const std::string& takes_folder, const std::string& name) {
  absl::string_view id = name;
  if (!absl::ConsumePrefix(&id, kTakePrefix)) return name;
  WEFT_RETURN_IF_ERROR(CheckTakeId(std::string(id)));
  return RecorderFiles(absl::StrCat(takes_folder, "/", id)).take;
}

}  // namespace weft
