// Options as users write them: files of --config, and --set PATH=VALUE.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "weft/v1/options.pb.h"

namespace weft {

// The largest file of options that is read.
inline constexpr uint64_t kMaxOptionBytes = uint64_t{1} << 20;

// Adds what `text` says, a v1::PipelineOptions in protobuf's text format (`#` begins a comment).
// InvalidArgument names source_name, the line, the option and what it may be.
absl::Status AddOptionText(const std::string& text, const std::string& source_name,
                           v1::PipelineOptions& options);

// The same on a file: errors of ReadWholeFile besides.
absl::Status AddOptionFile(const std::string& path, v1::PipelineOptions& options);

// Adds "triangulation.consensus.inlier_radius_mm=1.5". `stages`: those that may be set; all where it is
// empty. InvalidArgument names the option that was meant, or what its values may be.
absl::Status AddSetting(const std::string& setting, const std::vector<std::string>& stages,
                        v1::PipelineOptions& options);

// The path of the option that `name` most likely means; empty where none is near.
std::string NearestOption(std::string_view name);

// What `weft options --file` prints: every option that `options` has, with its sentence and range as a
// comment. AddOptionText reads it.
std::string OptionFileText(const v1::PipelineOptions& options);

}  // namespace weft
