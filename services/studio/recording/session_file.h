// session.json: the cameras of a live session.
#pragma once

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "services/studio/recording/live_recording.h"
#include "weft/v1/session.pb.h"

namespace weft {

// Before the id of a daemon's take where a path could stand.
inline constexpr char kTakePrefix[] = "take:";

// InvalidArgument names file and field. At least one camera, ids unique and fit for file names, every camera
// with a device.
absl::StatusOr<v1::Session> ReadSession(const std::string& path);
// The same of one that came another way; the message names `source` in place of the file.
absl::Status CheckSession(const v1::Session& session, const std::string& source);

// The devices of its cameras, as the session names them.
std::set<std::string> DevicesOf(const v1::Session& session);
// The folders of the takes that its cameras replay.
std::set<std::string> ReplayedTakesOf(const v1::Session& session);

// What the session says of sets and recorder, defaults filled in.
absl::StatusOr<LiveRecordingOptions> RecordingOptionsOf(const v1::Session& session);

// Opens all cameras; the first error otherwise.
absl::StatusOr<std::vector<std::unique_ptr<CameraSource>>> OpenCameras(const v1::Session& session);

}  // namespace weft
