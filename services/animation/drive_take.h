// Drives an avatar over the frames of a take, and writes ordinary results.
#pragma once

#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "services/animation/drive_inputs.h"
#include "weft/v1/job.pb.h"
#include "weft/v1/report.pb.h"

namespace weft {

// `done` frames of `all` are driven; `info` is the last one.
using DriveProgress = std::function<void(size_t done, size_t all, const v1::FrameInfo& info)>;

// Drives the frames one after another and writes <out>/<frame>/mesh.ply, report.json and, where asked for,
// observations.csv, then <out>/job.json and report.html, as a registration does. The next frame is decoded
// meanwhile. A frame that shows too little of the garment gets a report with state FAILED and the reason, and
// no mesh.
//
// A stopped run is resumed by the same request: complete frames of the same inputs and options stay as they
// are. The tracker knows them only by driving them, so they are driven again, without being written, from the
// last one on at which it had started anew. The files are the same in one go and in several, and at any
// number of threads, times aside.
//
// Returns the job as it ended, cancelled included. Errors of LoadDriveInputs, and of the folder of the
// results. FailedPrecondition, with both names: the rig's positions are in another unit than the template's.
// InvalidArgument: the results would lie in what is read.
absl::StatusOr<v1::Job> DriveTake(const DriveRequest& request, const DriveProgress& progress,
                                  const std::stop_token& stop);

}  // namespace weft
