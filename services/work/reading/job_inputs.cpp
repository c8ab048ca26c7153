#include "services/work/reading/job_inputs.h"

#include <memory>

#include "base/status_macros.h"
#include "services/work/animation/drive_inputs.h"
#include "services/work/pipeline/registration_inputs.h"

namespace weft {
namespace {

absl::StatusOr<LoadedInputs> LoadDrivingInputs(const v1::RegistrationSpec& spec) {
  WEFT_ASSIGN_OR_RETURN(const std::unique_ptr<DriveInputs> inputs,
                        LoadDriveInputs(spec, NetReading::kBytesAlone));
  WEFT_ASSIGN_OR_RETURN(const DriveFrameList list, ListDriveFrames(spec, *inputs));
  return LoadedInputs{list.Names(), inputs->hashes, inputs->warnings, DescribeDriving(spec, *inputs)};
}

}  // namespace

absl::StatusOr<LoadedInputs> LoadJobInputs(const v1::RegistrationSpec& spec) {
  if (spec.has_driving()) return LoadDrivingInputs(spec);
  WEFT_ASSIGN_OR_RETURN(const std::unique_ptr<RegistrationInputs> inputs, LoadInputs(spec));
  const std::vector<std::string>& names = inputs->dump->frame_names();
  WEFT_ASSIGN_OR_RETURN(const std::vector<size_t> range, FramesInRange(spec, names));
  WEFT_RETURN_IF_ERROR(AddExtraWarnings(spec, range, *inputs));
  LoadedInputs loaded{{}, inputs->hashes, inputs->warnings, std::nullopt};
  for (const size_t index : range) loaded.frames.push_back(names[index]);
  return loaded;
}

}  // namespace weft
