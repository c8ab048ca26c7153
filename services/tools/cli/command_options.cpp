// weft options: every option of the pipeline, its value, its range and what it means.
#include <cstdio>
#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "services/formats/options/option_range.h"
#include "services/formats/options/option_text.h"
#include "services/formats/options/presets.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/cli/pipeline_flags.h"
#include "weft/v1/command.pb.h"

namespace weft {
namespace {

struct OptionsCommandOptions {
  std::vector<std::string> names;
  std::string preset = kDefaultPreset;
  PipelineFlags pipeline;
  bool file = false;
  bool json = false;
};

bool IsWanted(const OptionField& option, const std::vector<std::string>& names) {
  if (names.empty()) return true;
  for (const std::string& name : names) {
    if (absl::StrContains(option.path, name)) return true;
  }
  return false;
}

// Names that are part of no option are mistakes.
absl::Status CheckNames(const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    bool found = false;
    for (const OptionField& option : AllOptions()) found = found || IsWanted(option, {name});
    if (found) continue;
    const std::string nearest = NearestOption(name);
    return absl::InvalidArgumentError(absl::StrCat(
        name, ": no such option", nearest.empty() ? "" : absl::StrCat("; did you mean ", nearest, "?")));
  }
  return absl::OkStatus();
}

v1::OptionList ListOptions(const v1::PipelineOptions& options, const std::vector<std::string>& names) {
  const v1::PipelineOptions defaults = MessageOf({});
  v1::OptionList list;
  for (const OptionField& option : AllOptions()) {
    if (option.IsGroup() || !IsWanted(option, names)) continue;
    v1::OptionInfo& info = *list.add_options();
    info.set_path(option.path);
    info.set_value(OptionValue(options, option));
    info.set_default_(OptionValue(defaults, option));
    info.set_unit(option.Unit());
    info.set_range(option.Range());
    info.set_text(option.About().text());
  }
  return list;
}

// "triangulation.consensus.inlier_radius_mm=1.5  (default 1; mm; above 0)", and the sentence below.
void PrintOption(const v1::OptionInfo& info) {
  std::string facts;
  const auto add = [&facts](const std::string& fact) {
    if (!fact.empty()) absl::StrAppend(&facts, facts.empty() ? "" : "; ", fact);
  };
  if (info.value() != info.default_()) add(absl::StrCat("default ", info.default_()));
  add(info.unit());
  add(info.range());
  std::printf("%s=%s%s\n    %s\n", info.path().c_str(), info.value().c_str(),
              facts.empty() ? "" : absl::StrCat("  (", facts, ")").c_str(), info.text().c_str());
}

absl::Status ShowOptions(const OptionsCommandOptions& options) {
  WEFT_RETURN_IF_ERROR(CheckNames(options.names));
  WEFT_ASSIGN_OR_RETURN(const CommandPipeline pipeline,
                        MakeCommandPipeline(options.preset, options.pipeline, AllStages()));
  if (options.file) {
    std::fputs(OptionFileText(pipeline.message).c_str(), stdout);
    return absl::OkStatus();
  }
  const v1::OptionList list = ListOptions(pipeline.message, options.names);
  if (options.json) return PrintJsonMessage(list);
  for (const v1::OptionInfo& info : list.options()) PrintOption(info);
  return absl::OkStatus();
}

}  // namespace

void AddOptionsCommand(CLI::App& app, CommandLine& line) {
  const auto [command, options] = AddCommand<OptionsCommandOptions>(
      app, line, ShowOptions, "options",
      "List the options of the pipeline: value, default, unit, range and meaning of each. They "
      "are set by --config and --set of `weft decode`, `register`, `align` and `template build`: "
      "the preset first, then the files, then the settings. report.json of a frame, job.json and "
      "--json repeat those that were in force.",
      "  weft options triangulation\n"
      "  weft options sigma_mm --preset paper\n"
      "  weft options --set triangulation.consensus.inlier_radius_mm=1.5 --file > studio.txtpb\n"
      "  weft register DUMP --rig rig.json --board board.png --template shirt --out result "
      "--config studio.txtpb");
  AddOption(*command, "name NAME", options->names, "Only options whose path contains this");
  AddOption(*command, "--preset NAME", options->preset, "The preset to begin with", OneOf(PresetNames()));
  AddPipelineFlags(*command, options->pipeline);
  auto* file = command->add_flag("--file", options->file, "Print all as a commented file for --config");
  command->add_flag("--json", options->json, "Print JSON (weft.v1.OptionList)")->excludes(file);
}

}  // namespace weft
