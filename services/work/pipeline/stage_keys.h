// Keys of a frame's results: which of them stand, and from which stage on they are computed again.
#pragma once

#include <google/protobuf/repeated_field.h>

#include <optional>
#include <string>

#include "services/work/pipeline/algorithm_versions.h"
#include "weft/v1/report.pb.h"

namespace weft {

using StageKeys = google::protobuf::RepeatedPtrField<v1::StageKey>;

// The keys of what this version of Weft computes from these inputs, with these options, in the order of the
// stages. Options of the second pass count where it is done, those of the refinement where frames do not
// stand alone. FrameReport.images_fingerprint identifies the frame's own images, scan and start.
StageKeys KeysOf(const v1::InputHashes& inputs, const v1::RegistrationOptions& options);

// The one of a stage.
v1::StageKey KeyOf(Stage stage, const v1::InputHashes& inputs, const v1::RegistrationOptions& options);
// Those of work that uses some stages of the pipeline, and adds its own.
template <Stage... kUsed>
StageKeys KeysOf(StageList<kUsed...>, const v1::InputHashes& inputs, const v1::RegistrationOptions& options) {
  StageKeys keys;
  ((*keys.Add() = KeyOf(kUsed, inputs, options)), ...);
  return keys;
}
// As keys hold inputs and options: 16 hex digits.
std::string HashOf(const std::string& text);

bool AreEqual(const StageKeys& a, const StageKeys& b);

struct StageDifference {
  Stage first;      // its results, and all that follow from them, are to be computed again
  std::string why;  // "align has version 2, was 1", "decode has other options"
};
// Where keys of a report part from those of now; none where they agree.
std::optional<StageDifference> FirstDifference(const StageKeys& was, const StageKeys& now);

// Explains why results differ from those that would be computed now: "computed again from align on, since
// align has version 2, was 1; observations and cloud are kept". `from` is the name of a stage.
std::string RedoneText(const std::string& from, const std::string& why);

}  // namespace weft
