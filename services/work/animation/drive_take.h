// A take driven by an avatar in this process, with ordinary results.
#pragma once

#include <functional>
#include <stop_token>

#include "absl/status/statusor.h"
#include "services/work/animation/drive_inputs.h"
#include "weft/v1/job.pb.h"

namespace weft {

// `done` frames of `all` are driven; `info` is the last one.
using DriveProgress = std::function<void(size_t done, size_t all, const v1::FrameInfo& info)>;

// DriveFrames for all frames of `spec`, whose options are as EffectiveDriveOptions has them, then
// <out>/job.json and report.html, as a registration writes them. A stopped run is resumed by the same
// request. Returns the job as it ended, cancelled included. Errors of LoadDriveInputs, ListDriveFrames and
// CheckOutOfInputs.
absl::StatusOr<v1::Job> DriveTake(const v1::RegistrationSpec& spec, int threads,
                                  const DriveProgress& progress, const std::stop_token& stop);

// A new job of this process, whose frames are still to come.
v1::Job NewDriveJob(const v1::RegistrationSpec& spec, const DriveInputs& inputs);

}  // namespace weft
