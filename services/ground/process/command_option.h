// How options of the programs are declared.
#pragma once

#include <CLI/CLI.hpp>

#include <string>
#include <utility>

namespace weft {

// An option with a value. `name` ends with the word that stands for the value in the help: "--rig FILE",
// "dump DUMP". One of a single word, "TAKE", stands there for itself.
template <typename Value>
CLI::Option* AddOption(CLI::App& command, const std::string& name, Value& value, const std::string& about) {
  const size_t space = name.find(' ');
  const std::string word = space == std::string::npos ? "" : name.substr(space + 1);
  return command.add_option(name.substr(0, space), value, about)->type_name(word);
}

// One whose values are checked.
template <typename Value>
CLI::Option* AddOption(CLI::App& command, const std::string& name, Value& value, const std::string& about,
                       CLI::Validator check) {
  return AddOption(command, name, value, about)->check(std::move(check));
}

// One that must be given.
template <typename Value>
CLI::Option* AddRequired(CLI::App& command, const std::string& name, Value& value, const std::string& about) {
  return AddOption(command, name, value, about)->required();
}

}  // namespace weft
