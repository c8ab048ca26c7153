#include "services/formats/options/presets.h"

#include <google/protobuf/text_format.h>

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "base/status_macros.h"
#include "services/formats/options/preset_files.h"

namespace weft {
namespace {

using google::protobuf::TextFormat;

constexpr char kPaper[] = "paper";

}  // namespace

std::vector<std::string> PresetNames() { return {kDefaultPreset, kPaper}; }

absl::StatusOr<v1::PipelineOptions> PresetOptions(std::string_view name) {
  v1::PipelineOptions preset = MessageOf({});
  if (name.empty() || name == kDefaultPreset) return preset;
  if (name != kPaper) {
    return absl::InvalidArgumentError(absl::StrCat("preset \"", std::string(name.substr(0, 64)),
                                                   "\" is unknown; it is ",
                                                   absl::StrJoin(PresetNames(), " or ")));
  }
  v1::PipelineOptions paper;
  if (!TextFormat::ParseFromString(kPaperFile, &paper))
    return absl::InternalError("config/paper.txtpb of this build cannot be read");
  preset.MergeFrom(paper);
  return preset;
}

absl::StatusOr<v1::PipelineOptions> EffectiveOptions(std::string_view preset,
                                                     const v1::PipelineOptions& changes) {
  WEFT_ASSIGN_OR_RETURN(v1::PipelineOptions all, PresetOptions(preset));
  all.MergeFrom(changes);
  WEFT_RETURN_IF_ERROR(ReadOptions(all).status());
  return all;
}

std::vector<std::string> RegistrationStages() {
  return {"decode", "triangulation", "second_pass", "alignment", "temporal"};
}

std::vector<std::string> AllStages() {
  std::vector<std::string> stages = RegistrationStages();
  stages.push_back("template_build");
  return stages;
}

v1::PipelineOptions OfStages(const v1::PipelineOptions& options, const std::vector<std::string>& stages) {
  v1::PipelineOptions kept = options;
  std::vector<const google::protobuf::FieldDescriptor*> fields;
  kept.GetReflection()->ListFields(kept, &fields);
  for (const auto* field : fields) {
    if (std::ranges::count(stages, field->name()) == 0) kept.GetReflection()->ClearField(&kept, field);
  }
  return kept;
}

absl::StatusOr<v1::RegistrationOptions> EffectiveOptions(const v1::RegistrationOptions& options) {
  WEFT_ASSIGN_OR_RETURN(v1::PipelineOptions pipeline, EffectiveOptions(options.preset(), options.pipeline()));
  if (options.single_pass()) pipeline.mutable_second_pass()->set_enabled(false);
  v1::RegistrationOptions effective = options;
  if (effective.preset().empty()) effective.set_preset(kDefaultPreset);
  *effective.mutable_pipeline() = OfStages(pipeline, RegistrationStages());
  return effective;
}

absl::StatusOr<JobOptions> MakeJobOptions(const v1::RegistrationOptions& options) {
  WEFT_ASSIGN_OR_RETURN(v1::RegistrationOptions message, EffectiveOptions(options));
  WEFT_ASSIGN_OR_RETURN(PipelineOptions pipeline, ReadOptions(message.pipeline()));
  return JobOptions{std::move(message), std::move(pipeline)};
}

std::string StageOptionsText(const v1::PipelineOptions& effective, const std::string& stage) {
  const google::protobuf::FieldDescriptor* field = v1::PipelineOptions::descriptor()->FindFieldByName(stage);
  if (field == nullptr || !effective.GetReflection()->HasField(effective, field)) return "";
  TextFormat::Printer printer;
  printer.SetSingleLineMode(true);
  std::string text;
  printer.PrintToString(effective.GetReflection()->GetMessage(effective, field), &text);
  return text;
}

}  // namespace weft
