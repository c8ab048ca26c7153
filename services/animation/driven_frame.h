// A driven frame as a result: its report and its files.
#pragma once

#include <cstddef>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "animation/sparse_view_driver.h"
#include "services/animation/drive_inputs.h"
#include "services/pipeline/frame_cloud.h"
#include "weft/v1/report.pb.h"

namespace weft {

// What all frames of a run share. Changes where the results of two runs may differ.
std::string DriveKey(const DriveRequest& request, const DriveInputs& inputs);

// Which earlier result of a frame stands.
struct DrivenStanding {
  bool complete = false;
  bool started_anew = false;  // its result does not depend on the frames before
};
// `out` is an absolute path without links; `at` a position in inputs.frames.
DrivenStanding InspectDrivenFrame(const DriveRequest& request, const DriveInputs& inputs, size_t at,
                                  const std::string& key, const std::string& out);

// The report of a frame, without its files. `fingerprint` of its images as they were before they were read.
v1::FrameReport DescribeDriven(const DriveRequest& request, const DriveInputs& inputs, size_t at,
                               const std::string& key, const std::string& fingerprint,
                               const DecodedFrame& decoded, const DrivenFrame& driven);

// Replaces the frame's files, the report last; everything is on the disk when it returns.
absl::Status WriteDriven(const DriveInputs& inputs, const DecodedFrame& decoded, const DrivenFrame& driven,
                         v1::FrameReport report, const std::string& out);

}  // namespace weft
