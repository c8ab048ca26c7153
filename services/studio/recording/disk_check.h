// Whether the disk keeps up with the cameras, asked before a take.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "capture/camera/camera_source.h"
#include "services/studio/recording/disk_speed.h"
#include "services/studio/recording/live_recording.h"

namespace weft {

// What the cameras send in a second, from their settings and the rate of the session.
// Nothing where a camera does not say how large its frames are, or the session names no rate.
std::optional<double> DataRate_bytes_per_s(const std::vector<std::unique_ptr<CameraSource>>& cameras,
                                           const LiveRecordingOptions& options);

// How much a test writes: what the cameras send in a second, 16 MiB at the least and 1 GiB at most.
uint64_t DiskTestBytes(double bytes_per_s);

// FailedPrecondition where the disk takes less than the cameras send: how fast the queue fills, and what to
// do. Otherwise warnings, in words: less than a quarter to spare, not enough room for the take's seconds
// above the low-disk mark. Compressed streams count as if they were not: noise decides how small they
// become, so that they are warned of and not refused.
absl::StatusOr<std::vector<std::string>> AssessDisk(const DiskSpeed& speed, double bytes_per_s,
                                                    const LiveRecordingOptions& options);

// The same of a test in `folder`; no warnings where the cameras' rate is unknown. `no_test` is what records
// all the same, for whoever reads the error. Errors of MeasureDiskSpeed besides.
absl::StatusOr<std::vector<std::string>> TestDisk(const std::string& folder,
                                                  const std::vector<std::unique_ptr<CameraSource>>& cameras,
                                                  const LiveRecordingOptions& options,
                                                  const std::string& no_test);

}  // namespace weft
