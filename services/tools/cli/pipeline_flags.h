// --config and --set: options of the pipeline on the command line.
#pragma once

#include <CLI/CLI.hpp>

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "services/formats/options/pipeline_options.h"

namespace weft {

struct PipelineFlags {
  std::vector<std::string> configs;     // files, in their order
  std::vector<std::string> settings;    // OPTION=VALUE, after all files
  std::vector<std::string> shorthands;  // OPTION=VALUE of options of the command itself, after all settings
};

void AddPipelineFlags(CLI::App& command, PipelineFlags& flags);

// As `weft options` prints it.
std::string DefaultOfOption(const std::string& path);

// What the flags change in a preset. `stages`: those that the command has; --set of another one is an error,
// a file may hold it for other commands. InvalidArgument names file and line, or the setting.
absl::StatusOr<v1::PipelineOptions> ChangesOf(const PipelineFlags& flags,
                                              const std::vector<std::string>& stages);

// The options that a command works with, and how it tells of them: every option of its stages.
struct CommandPipeline {
  PipelineOptions options;
  v1::PipelineOptions message;
};
absl::StatusOr<CommandPipeline> MakeCommandPipeline(const std::string& preset, const PipelineFlags& flags,
                                                    const std::vector<std::string>& stages);

}  // namespace weft
