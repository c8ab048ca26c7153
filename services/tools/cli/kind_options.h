// Options of commands as the descriptions of kinds of work have them (services/work/spec/kind_info.h).
#pragma once

#include <string>
#include <vector>

#include "services/ground/process/command_option.h"
#include "services/tools/cli/pipeline_flags.h"
#include "weft/v1/work.pb.h"

namespace weft {

// Declares inputs and options of a kind. Types, ranges, choices, help and what is required are the
// description's; the order is that of the calls. There must be such a kind, and such a name.
class KindOptions {
 public:
  KindOptions(CLI::App& command, const std::string& kind);

  template <typename Value>
  void operator()(const std::string& name, Value& place) {
    Restrict(name, AddOption(command_, WithValueWord(name), place, LabelOf(name)));
  }
  void operator()(const std::string& name, bool& place) {
    command_.add_flag("--" + name, place, LabelOf(name));
  }
  // It stands for an option of the pipeline, "template_build.openings".
  void operator()(const std::string& name, PipelineFlags& flags, const std::string& path);

 private:
  const v1::WorkInputInfo* Input(const std::string& name) const;
  const v1::WorkOptionInfo& Option(const std::string& name) const;
  const std::string& LabelOf(const std::string& name) const;
  std::string WithValueWord(const std::string& name) const;  // "--max-gap-mm MM"
  void Restrict(const std::string& name, CLI::Option* option) const;

  CLI::App& command_;
  const v1::WorkKindInfo& kind_;
};

// What the command line says of the kind's inputs and options; `others`: what else is given.
v1::WorkSpec WorkOf(const v1::WorkKindInfo& kind, const CLI::App& command,
                    std::vector<const CLI::Option*>* others);

}  // namespace weft
