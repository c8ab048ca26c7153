// Drives decoded frames one after another and writes their results.
#pragma once

#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "animation/sparse_view/sparse_view_driver.h"
#include "base/stopwatch.h"
#include "services/work/animation/drive_inputs.h"
#include "services/work/animation/driven_frame.h"
#include "weft/v1/report.pb.h"

namespace weft {

// Thread safety: none. Parallel loops run in the calling thread's TBB arena.
class FrameDriver {
 public:
  // `spec` and `inputs` must outlive it; `out` is an absolute path without links. Errors of SparseViewDriver.
  static absl::StatusOr<FrameDriver> Create(const v1::RegistrationSpec& spec, const DriveInputs& inputs,
                                            StageKeys keys, std::string out);

  // What the driver knows of the frames so far, EncodeMemory.
  const std::string& memory() const { return memory_; }
  // Goes on from there; `frame` is the one that it was written with, whose mesh belongs to it.
  // InvalidArgument: it cannot be the memory of this avatar. Errors of ReadRegisteredMesh.
  absl::Status Restore(const std::string& memory, const std::string& frame);

  // Drives the frame, of which `watch` has run since it was begun, and returns its report, which is not yet
  // written. FailedPrecondition, with both names: the rig's positions are in another unit than the
  // template's.
  struct Driven {
    DrivenFrame frame;
    v1::FrameReport report;
  };
  absl::StatusOr<Driven> Drive(const SeenFrame& seen, const Stopwatch& watch);
  // Errors of WriteDriven.
  absl::Status Write(const SeenFrame& seen, const Driven& driven) const;

 private:
  FrameDriver(const v1::RegistrationSpec& spec, const DriveInputs& inputs, StageKeys keys, std::string out,
              SparseViewDriver driver);
  absl::Status CheckScaleOnce(const std::vector<ViewObservations>& views);

  const v1::RegistrationSpec* spec_;
  const DriveInputs* inputs_;
  StageKeys keys_;
  std::string out_;
  SparseViewDriver driver_;
  std::string memory_;
  bool knows_scale_ = false;
};

}  // namespace weft
