// Recorders as processes: started, looked at, stopped, and what becomes of the take of one that died.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "weft/v1/recorder.pb.h"

namespace weft {

// Writes the request into `folder`, which exists and is empty, and starts `program` (weft-recorder) on it.
// The process has a session of its own and none of ours' descriptors: it goes on when this process ends,
// however that happens. Returns when it lives. InvalidArgument: the request. NotFound: no such program.
// Internal: it did not start.
absl::Status StartRecorder(const std::string& program, const std::string& folder,
                           const v1::RecorderRequest& request);

struct RecorderView {
  v1::RecorderRequest request;
  v1::RecorderState state;
  bool lives = false;  // the process; its last state may be older where it does not
};
// NotFound: no recorder was started there.
absl::StatusOr<RecorderView> InspectRecorder(const std::string& folder);

// Asks a recorder to close its take; it does so within its cameras' patience. One that has ended stays as it
// is.
absl::Status StopRecorder(const std::string& folder);

// InspectRecorder, but the take of a recorder that was killed, crashed or could not close it is closed with
// all that was acknowledged, and its state says so. Where that cannot be done at this time, for example on a
// full disk, the state says so, too, and the next call tries again. One at a time per folder.
absl::StatusOr<RecorderView> RecoverIfDead(const std::string& folder);

// False while a take waits for RecoverIfDead: what stands in it may be damaged. True where no recorder was
// started.
bool IsSettled(const std::string& folder);

}  // namespace weft
