#include "services/work/animation/frame_driver.h"

#include <tbb/task_arena.h>

#include <filesystem>
#include <optional>
#include <utility>
#include <vector>

#include "base/status_macros.h"
#include "services/formats/files/mesh_file.h"
#include "services/work/animation/driver_memory.h"
#include "services/work/animation/driving_views.h"
#include "services/work/animation/rig_scale.h"

namespace weft {

absl::StatusOr<FrameDriver> FrameDriver::Create(const v1::RegistrationSpec& spec, const DriveInputs& inputs,
                                                StageKeys keys, std::string out) {
  WEFT_ASSIGN_OR_RETURN(SparseViewDriver driver,
                        SparseViewDriver::Create(inputs.garment, inputs.avatar.avatar));
  return FrameDriver(spec, inputs, std::move(keys), std::move(out), std::move(driver));
}

FrameDriver::FrameDriver(const v1::RegistrationSpec& spec, const DriveInputs& inputs, StageKeys keys,
                         std::string out, SparseViewDriver driver)
    : spec_(&spec),
      inputs_(&inputs),
      keys_(std::move(keys)),
      out_(std::move(out)),
      driver_(std::move(driver)) {}

absl::Status FrameDriver::Restore(const std::string& memory, const std::string& frame) {
  if (memory == memory_) return absl::OkStatus();
  WEFT_ASSIGN_OR_RETURN(DriverMemory decoded, DecodeMemory(memory));
  if (decoded.drive.track.known > 0) {
    WEFT_ASSIGN_OR_RETURN(const auto mesh,
                          ReadRegisteredMesh((std::filesystem::path(out_) / frame / "mesh.ply").string()));
    for (const Eigen::Vector3d& p : mesh.vertices_mm) decoded.drive.mesh_mm.push_back(p.cast<float>());
  }
  absl::Status status = driver_.Restore(std::move(decoded));
  if (status.ok()) memory_ = memory;
  return status;
}

absl::StatusOr<FrameDriver::Driven> FrameDriver::Drive(const SeenFrame& seen, const Stopwatch& watch) {
  if (!seen.fingerprint.ok()) return seen.fingerprint.status();
  WEFT_RETURN_IF_ERROR(CheckScaleOnce(seen.decoded.views));
  WEFT_ASSIGN_OR_RETURN(DrivenFrame driven,
                        driver_.Drive(seen.time_ns, DrivingViewsOf(seen.decoded.views, inputs_->rig)));
  const std::string follows = std::exchange(memory_, EncodeMemory(driver_.Memory()));
  v1::FrameReport report = DescribeDriven(*spec_, *inputs_, keys_, seen, driven, follows, memory_);
  const auto add_time = [&report](const std::string& stage, double time_ms) {
    v1::StageTime& time = *report.add_stages();
    time.set_stage(stage);
    time.set_time_ms(time_ms);
  };
  add_time("decode", seen.decode_ms);
  for (const StageTime& stage : driven.times) add_time(stage.name, stage.time_ms);
  report.set_total_ms(watch.Ms());
  report.set_threads(tbb::this_task_arena::max_concurrency());
  return Driven{std::move(driven), std::move(report)};
}

absl::Status FrameDriver::Write(const SeenFrame& seen, const Driven& driven) const {
  return WriteDriven(*inputs_, seen, driven.frame, driven.report, out_);
}

// The first frame that tells the unit of the rig.
absl::Status FrameDriver::CheckScaleOnce(const std::vector<ViewObservations>& views) {
  if (knows_scale_) return absl::OkStatus();
  const std::optional<double> scale = RigScale(inputs_->rig, views, inputs_->garment, inputs_->graph);
  if (!scale) return absl::OkStatus();
  knows_scale_ = true;
  return CheckRigScale(*scale, spec_->rig(), spec_->garment());
}

}  // namespace weft
