// What weft-recorder does: one take, from its request to its end.
#pragma once

#include <atomic>
#include <string>

#include "absl/status/status.h"

namespace weft {

// Records what <folder>/request.json asks for into <folder>/take, until its time is over, `stop` becomes true
// or the recorder has to stop, and keeps <folder>/state.json up to date. The last state says what the
// returned status says. Errors of ReadJsonFile, OpenCameras, AssessDisk and RecordLive.
absl::Status RunRecorder(const std::string& folder, const std::atomic<bool>& stop);

}  // namespace weft
