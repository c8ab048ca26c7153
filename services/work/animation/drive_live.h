// A garment driven as frames arrive: from cameras, from a take that is being recorded, or from one replayed.
#pragma once

#include <functional>
#include <stop_token>
#include <string>

#include "absl/status/statusor.h"
#include "weft/v1/job.pb.h"

namespace weft {

struct LiveDriveRequest {
  // As of DriveTake. `spec.dump`: a recorded take or a folder of images. A take that is being recorded is
  // followed; another recording is replayed.
  v1::RegistrationSpec spec;
  double speed = 1;          // of a replay, times as fast as it was taken
  std::string session_file;  // not empty: its cameras are filmed, and recorded into the new folder spec.dump
  int threads = 0;           // 0: all cores
};

// How it goes: after each frame, and at the end.
using LiveDriveProgress = std::function<void(const v1::LiveDriving& now, const v1::FrameInfo& info)>;

// "latency 92 ms (median), 141 ms (95 %), 11.4 frames/s, 60 of 180 passed over".
std::string LiveDrivingText(const v1::LiveDriving& live);

// Drives always the newest frame; those that it overtakes are passed over and have no result. One frame is
// decoded while the one before is driven and the one before that is written. Results and reports are those of
// DriveTake; what they hold depends on the frames that were passed over. Ends with the recording, and well
// when `stop` is requested: frames finished by then are complete.
//
// The same request goes on where an earlier one stopped, after the last frame that has a result; what the
// driver knew then is read. With a session the folders of take and results must be new. FailedPrecondition:
// the folder holds results of another run. InvalidArgument: options that do not go together. Errors of
// LoadDriveInputs, CheckOutOfInputs, FrameDriver, and of the recording.
absl::StatusOr<v1::Job> DriveLive(const LiveDriveRequest& request, const LiveDriveProgress& progress,
                                  const std::stop_token& stop);

}  // namespace weft
