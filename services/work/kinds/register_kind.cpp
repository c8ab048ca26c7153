#include "services/work/kinds/take_kinds.h"

#include <algorithm>
#include <utility>

#include "base/status_macros.h"
#include "services/formats/options/presets.h"
#include "services/work/pipeline/registration_inputs.h"
#include "services/work/pipeline/scratch_frames.h"

namespace weft {
namespace {

class Registration : public Work {
 public:
  Registration(const v1::RegistrationSpec& spec, std::unique_ptr<RegistrationInputs> inputs,
               std::vector<size_t> range)
      : options_(spec.options()), inputs_(std::move(inputs)), range_(std::move(range)) {
    loaded_.hashes = inputs_->hashes;
    loaded_.warnings = inputs_->warnings;
    for (const size_t index : range_) loaded_.frames.push_back(inputs_->dump->frame_names()[index]);
  }

  const LoadedInputs& inputs() const override { return loaded_; }

  absl::Status Run(const std::vector<size_t>& frames, const WorkPlace& place,
                   const RegistrationEvents& events, const std::stop_token& stop) override {
    std::vector<size_t> indices;  // in the dump
    for (const size_t frame : frames) indices.push_back(range_[frame]);
    RegistrationEvents heard = events;
    if (!place.scratch_folder.empty()) {
      WEFT_ASSIGN_OR_RETURN(heard.reads, CopyAhead(indices, place));
    }
    return RegisterFrames(*inputs_, range_, indices, options_, place.out, place.limits, heard, stop);
  }

  absl::StatusOr<std::vector<IncompleteFrame>> FindIncomplete(
      const v1::Job& job, const std::vector<v1::FrameInfo>& frames) const override {
    return FindIncompleteFrames(job, frames);
  }

 private:
  // Images are read from copies from now on; the function makes those of a frame and of the next one.
  absl::StatusOr<std::function<absl::Status(size_t)>> CopyAhead(const std::vector<size_t>& indices,
                                                                const WorkPlace& place) {
    WEFT_ASSIGN_OR_RETURN(
        std::unique_ptr<ScratchFrames> scratch,
        ScratchFrames::Create(std::move(inputs_->dump), inputs_->rig.cameras.size(),
                              {.folder = place.scratch_folder, .quota_bytes = place.scratch_bytes}));
    ScratchFrames* const copies = scratch.get();
    inputs_->dump = std::move(scratch);
    return [indices, copies](size_t index) {
      const auto at = std::find(indices.begin(), indices.end(), index);
      const bool is_last = at == indices.end() || at + 1 == indices.end();
      return copies->Hold(index, is_last ? std::nullopt : std::optional<size_t>(at[1]));
    };
  }

  const v1::RegistrationOptions options_;
  const std::unique_ptr<RegistrationInputs> inputs_;
  const std::vector<size_t> range_;  // positions in the dump
  LoadedInputs loaded_;
};

}  // namespace

absl::StatusOr<v1::RegistrationOptions> RegisterKind::Effective(const v1::RegistrationOptions& asked) const {
  return EffectiveOptions(asked);
}

absl::StatusOr<std::unique_ptr<Work>> RegisterKind::Load(const v1::RegistrationSpec& spec,
                                                         LoadFor purpose) const {
  WEFT_ASSIGN_OR_RETURN(std::unique_ptr<RegistrationInputs> inputs, LoadInputs(spec));
  WEFT_ASSIGN_OR_RETURN(std::vector<size_t> range, FramesInRange(spec, inputs->dump->frame_names()));
  if (purpose != LoadFor::kTask) {
    WEFT_RETURN_IF_ERROR(AddExtraWarnings(spec, range, *inputs));
  }
  return std::make_unique<Registration>(spec, std::move(inputs), std::move(range));
}

absl::StatusOr<std::vector<IncompleteFrame>> RegisterKind::FindIncomplete(
    const v1::Job& job, const std::vector<v1::FrameInfo>& frames) const {
  return FindIncompleteFrames(job, frames);
}

}  // namespace weft
