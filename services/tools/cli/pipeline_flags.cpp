#include "services/tools/cli/pipeline_flags.h"

#include <utility>

#include "services/formats/options/option_text.h"
#include "services/formats/options/presets.h"

namespace weft {

void AddPipelineFlags(CLI::App& command, PipelineFlags& flags) {
  command
      .add_option("--config", flags.configs,
                  "Options that change the preset, a file as `weft options --file` prints it; a later file "
                  "changes an earlier one")
      ->type_name("FILE")
      ->allow_extra_args(false);
  command
      .add_option("--set", flags.settings,
                  "One option, after all files, e.g. decode.levels=2; `weft options` lists all")
      ->type_name("OPTION=VALUE")
      ->allow_extra_args(false);
}

absl::StatusOr<v1::PipelineOptions> ChangesOf(const PipelineFlags& flags,
                                              const std::vector<std::string>& stages) {
  v1::PipelineOptions changes;
  for (const std::string& file : flags.configs) {
    if (absl::Status status = AddOptionFile(file, changes); !status.ok()) return status;
  }
  for (const std::string& setting : flags.settings) {
    if (absl::Status status = AddSetting(setting, stages, changes); !status.ok()) return status;
  }
  changes.MergeFrom(flags.named);
  return changes;
}

absl::StatusOr<CommandPipeline> MakeCommandPipeline(const std::string& preset, const PipelineFlags& flags,
                                                    const std::vector<std::string>& stages) {
  const absl::StatusOr<v1::PipelineOptions> changes = ChangesOf(flags, stages);
  if (!changes.ok()) return changes.status();
  const absl::StatusOr<v1::PipelineOptions> effective = EffectiveOptions(preset, *changes);
  if (!effective.ok()) return effective.status();
  absl::StatusOr<PipelineOptions> options = ReadOptions(*effective);
  if (!options.ok()) return options.status();
  return CommandPipeline{*std::move(options), OfStages(*effective, stages)};
}

}  // namespace weft
