#include "services/tools/cli/pipeline_flags.h"

#include <utility>

#include "base/status_macros.h"
#include "services/formats/options/option_range.h"
#include "services/formats/options/option_text.h"
#include "services/formats/options/presets.h"
#include "services/ground/process/command_option.h"

namespace weft {

void AddPipelineFlags(CLI::App& command, PipelineFlags& flags) {
  AddOption(command, "--config FILE", flags.configs,
            "Options that change the preset, a file as `weft options --file` prints it; a later file changes "
            "an earlier one")
      ->allow_extra_args(false);
  AddOption(command, "--set OPTION=VALUE", flags.settings,
            "One option, after all files, e.g. decode.levels=2; `weft options` lists all")
      ->allow_extra_args(false);
}

std::string DefaultOfOption(const std::string& path) {
  for (const OptionField& option : AllOptions())
    if (option.path == path) return OptionValue(MessageOf({}), option);
  return "";
}

absl::StatusOr<v1::PipelineOptions> ChangesOf(const PipelineFlags& flags,
                                              const std::vector<std::string>& stages) {
  v1::PipelineOptions changes;
  for (const std::string& file : flags.configs) {
    WEFT_RETURN_IF_ERROR(AddOptionFile(file, changes));
  }
  for (const auto* settings : {&flags.settings, &flags.shorthands}) {
    for (const std::string& setting : *settings) WEFT_RETURN_IF_ERROR(AddSetting(setting, stages, changes));
  }
  return changes;
}

absl::StatusOr<CommandPipeline> MakeCommandPipeline(const std::string& preset, const PipelineFlags& flags,
                                                    const std::vector<std::string>& stages) {
  WEFT_ASSIGN_OR_RETURN(const v1::PipelineOptions changes, ChangesOf(flags, stages));
  WEFT_ASSIGN_OR_RETURN(const v1::PipelineOptions effective, EffectiveOptions(preset, changes));
  WEFT_ASSIGN_OR_RETURN(PipelineOptions options, ReadOptions(effective));
  return CommandPipeline{std::move(options), OfStages(effective, stages)};
}

}  // namespace weft
