// From a preset and what is changed in it to all options of a job. The one place that knows the presets.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "services/formats/options/pipeline_options.h"
#include "weft/v1/report.pb.h"

namespace weft {

// What an empty name means.
inline constexpr char kDefaultPreset[] = "best";

// In the order in which they are listed.
std::vector<std::string> PresetNames();

// Every option as the preset has it. "best" is what the code of the stages has, "paper" is
// config/paper.txtpb. InvalidArgument lists the names.
absl::StatusOr<v1::PipelineOptions> PresetOptions(std::string_view name);

// Every option as the preset has it, or as `changes` say. Errors of PresetOptions and ReadOptions.
absl::StatusOr<v1::PipelineOptions> EffectiveOptions(std::string_view preset,
                                                     const v1::PipelineOptions& changes);

// The stages by their names, fields of PipelineOptions: those of a registration, and all.
std::vector<std::string> RegistrationStages();
std::vector<std::string> AllStages();

// `options` of these stages alone.
v1::PipelineOptions OfStages(const v1::PipelineOptions& options, const std::vector<std::string>& stages);

// A registration's options with everything spelled out, so that equal settings compare equal: the preset's
// name, and `pipeline` with every option of the stages that a registration has. Does nothing to options that
// are spelled out.
absl::StatusOr<v1::RegistrationOptions> EffectiveOptions(const v1::RegistrationOptions& options);

// JobOptions::kept_image_bytes, where nothing is said. Where images are JPEG, new pages of memory cost as
// much as reading an image again does.
inline constexpr int64_t kDefaultKeptImageMib = 32;

// A job's options as they stand in its files, and as its stages take them. Made once.
struct JobOptions {
  v1::RegistrationOptions message;  // EffectiveOptions
  PipelineOptions pipeline;
  // Memory for images that wait for the second pass; those beyond are read again. No result depends on it, so
  // it is no part of the message.
  size_t kept_image_bytes = size_t{kDefaultKeptImageMib} << 20;
};
absl::StatusOr<JobOptions> MakeJobOptions(const v1::RegistrationOptions& options);

// One line that differs where an option of the stage does; `stage` is a field of PipelineOptions, e.g.
// "decode". `effective` comes from EffectiveOptions. Empty for a stage that is left out.
std::string StageOptionsText(const v1::PipelineOptions& effective, const std::string& stage);

}  // namespace weft
