// A driven frame as a result: its report and its files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "animation/sparse_view/sparse_view_driver.h"
#include "services/work/animation/drive_inputs.h"
#include "services/work/pipeline/frame_cloud.h"
#include "services/work/pipeline/results_check.h"
#include "services/work/pipeline/stage_keys.h"
#include "weft/v1/report.pb.h"

namespace weft {

// The views of a frame, decoded.
struct SeenFrame {
  std::string name;
  int64_t time_ns = 0;
  absl::StatusOr<std::string> fingerprint;  // of its images as they were before they were read
  DecodedFrame decoded;
  double decode_ms = 0;
  std::vector<std::string> unknown_cameras;  // of the dump
};
// Runs in the calling thread's TBB arena.
SeenFrame SeeFrame(const DriveInputs& inputs, const FrameSource& dump, size_t index, int64_t time_ns,
                   const std::stop_token& stop);

// The keys of all frames of a run, one for each stage: decoding as registrations key it, then driving.
// They differ where the results of two runs may: frames that were driven as they arrived depend on which
// ones were passed over.
enum class DrivePace { kEveryFrame, kLive };
StageKeys DriveKeys(const v1::RegistrationSpec& spec, const DriveInputs& inputs,
                    DrivePace pace = DrivePace::kEveryFrame);

// The report of a complete frame of this run as it stands on the disk; empty where there is none. Whether it
// follows the frame before it is for the caller to see (DrivenReport.follows). `out` is an absolute path
// without links.
std::optional<v1::FrameReport> CachedReport(const std::string& out, const std::string& frame,
                                            const StageKeys& keys, const std::string& fingerprint,
                                            bool wants_observations);

// The report of a frame, without its files. `follows`: EncodeMemory before the frame, `memory` after it.
v1::FrameReport DescribeDriven(const v1::RegistrationSpec& spec, const DriveInputs& inputs,
                               const StageKeys& keys, const SeenFrame& seen, const DrivenFrame& driven,
                               const std::string& follows, const std::string& memory);

// Replaces the frame's files, the report last; everything is on the disk when it returns.
absl::Status WriteDriven(const DriveInputs& inputs, const SeenFrame& seen, const DrivenFrame& driven,
                         v1::FrameReport report, const std::string& out);

// As FindIncompleteFrames of a job with these inputs, and each frame must follow the one before it.
absl::StatusOr<std::vector<IncompleteFrame>> FindIncompleteDriven(const DriveInputs& inputs,
                                                                  const DriveFrameList& list,
                                                                  const v1::Job& job,
                                                                  const std::vector<v1::FrameInfo>& frames);

}  // namespace weft
