#include "services/work/kinds/take_kinds.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/work/animation/drive_frames.h"
#include "services/work/animation/drive_inputs.h"
#include "services/work/animation/driven_frame.h"

namespace weft {
namespace {

constexpr int kMostCameras = 1000;

class Driving : public Work {
 public:
  Driving(const v1::RegistrationSpec& spec, std::unique_ptr<DriveInputs> inputs, DriveFrameList list)
      : spec_(spec),
        inputs_(std::move(inputs)),
        list_(std::move(list)),
        loaded_{list_.Names(), inputs_->hashes, inputs_->warnings, DescribeDriving(spec, *inputs_)} {}

  const LoadedInputs& inputs() const override { return loaded_; }

  absl::Status Run(const std::vector<size_t>& frames, const WorkPlace& place,
                   const RegistrationEvents& events, const std::stop_token& stop) override {
    std::vector<size_t> in_order = frames;
    std::sort(in_order.begin(), in_order.end());
    return DriveFrames(spec_, *inputs_, list_, in_order, place.out, place.limits.threads, events, stop);
  }

  absl::StatusOr<std::vector<IncompleteFrame>> FindIncomplete(
      const v1::Job& job, const std::vector<v1::FrameInfo>& frames) const override {
    return FindIncompleteDriven(*inputs_, list_, job, frames);
  }

 private:
  const v1::RegistrationSpec spec_;
  const std::unique_ptr<DriveInputs> inputs_;
  const DriveFrameList list_;
  const LoadedInputs loaded_;
};

}  // namespace

std::optional<SpecFault> DriveKind::FaultOf(const v1::RegistrationSpec& spec) const {
  const v1::DrivingSpec& driving = spec.driving();
  if (driving.cameras_size() > kMostCameras)
    return SpecFault{"spec.driving.cameras", absl::StrCat("names ", driving.cameras_size(), " cameras"),
                     absl::StrCat("at most ", kMostCameras, " are allowed")};
  if (!(driving.fps() >= 0) || !std::isfinite(driving.fps()))
    return SpecFault{"spec.driving.fps", "is no number of frames per second", "give 0 for the avatar's"};
  if (spec.live_every() > 1)
    return SpecFault{"spec.live_every", absl::StrCat("is ", spec.live_every(), " with spec.driving"),
                     "give 1: every frame is driven from the one before"};
  if (!spec.options().scans().empty() || !spec.options().starts().empty())
    return SpecFault{"spec.options", "names scans or starts", "an avatar needs neither; leave them out"};
  return std::nullopt;
}

absl::StatusOr<v1::RegistrationOptions> DriveKind::Effective(const v1::RegistrationOptions& asked) const {
  return EffectiveDriveOptions(asked);
}

absl::StatusOr<std::unique_ptr<Work>> DriveKind::Load(const v1::RegistrationSpec& spec,
                                                      LoadFor purpose) const {
  const NetReading net = purpose == LoadFor::kListing ? NetReading::kBytesAlone : NetReading::kRun;
  WEFT_ASSIGN_OR_RETURN(std::unique_ptr<DriveInputs> inputs, LoadDriveInputs(spec, net));
  WEFT_ASSIGN_OR_RETURN(DriveFrameList list, ListDriveFrames(spec, *inputs));
  return std::make_unique<Driving>(spec, std::move(inputs), std::move(list));
}

absl::StatusOr<std::vector<IncompleteFrame>> DriveKind::FindIncomplete(
    const v1::Job& job, const std::vector<v1::FrameInfo>& frames) const {
  WEFT_ASSIGN_OR_RETURN(const std::unique_ptr<Work> work, Load(job.spec(), LoadFor::kListing));
  return work->FindIncomplete(job, frames);
}

}  // namespace weft
