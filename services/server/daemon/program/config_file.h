// weftd's options in a file: a v1::DaemonConfig in protobuf's text format, as all other files of options.
#pragma once

#include <CLI/CLI.hpp>

#include <map>
#include <string>

#include "absl/status/status.h"

namespace weft {

// Gives the options of `app` that no argument gave the values that `path` has for them. A field is named as
// its option, with `_` for `-`. Errors of ReadWholeFile; InvalidArgument names file, line, field and remedy.
absl::Status ApplyConfigFile(const std::string& path, CLI::App& app);

// Every option of `app` with its sentence, as ApplyConfigFile reads them. Those that were not given are
// comments with their defaults.
std::string ConfigFileText(const CLI::App& app);

// The values in force as text, by field.
std::map<std::string, std::string> SettingsOf(const CLI::App& app);

}  // namespace weft
