#include "services/work/reading/job_inputs.h"

#include <memory>

#include "services/work/animation/drive_inputs.h"
#include "services/work/pipeline/registration_inputs.h"

namespace weft {
namespace {

absl::StatusOr<LoadedInputs> LoadDrivingInputs(const v1::RegistrationSpec& spec) {
  const absl::StatusOr<std::unique_ptr<DriveInputs>> inputs = LoadDriveInputs(spec, NetReading::kBytesAlone);
  if (!inputs.ok()) return inputs.status();
  const absl::StatusOr<DriveFrameList> list = ListDriveFrames(spec, **inputs);
  if (!list.ok()) return list.status();
  return LoadedInputs{list->Names(), (*inputs)->hashes, (*inputs)->warnings, DescribeDriving(spec, **inputs)};
}

}  // namespace

absl::StatusOr<LoadedInputs> LoadJobInputs(const v1::RegistrationSpec& spec) {
  if (spec.has_driving()) return LoadDrivingInputs(spec);
  const absl::StatusOr<std::unique_ptr<RegistrationInputs>> inputs = LoadInputs(spec);
  if (!inputs.ok()) return inputs.status();
  const std::vector<std::string>& names = (*inputs)->dump->frame_names();
  const absl::StatusOr<std::vector<size_t>> range = FramesInRange(spec, names);
  if (!range.ok()) return range.status();
  if (absl::Status status = AddExtraWarnings(spec, *range, **inputs); !status.ok()) return status;
  LoadedInputs loaded{{}, (*inputs)->hashes, (*inputs)->warnings, std::nullopt};
  for (const size_t index : *range) loaded.frames.push_back(names[index]);
  return loaded;
}

}  // namespace weft
