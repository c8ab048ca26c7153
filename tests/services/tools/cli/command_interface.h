// What scripts rely on of a command, as text: its words, and of each option its names, the values that it
// takes, its default, and what it needs or excludes.
#pragma once

#include <CLI/CLI.hpp>
#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace weft {

// Of a set of options, in an order that does not depend on where they lie in memory.
inline std::string NamesOfOptions(const std::set<CLI::Option*>& options) {
  std::vector<std::string> names;
  for (const CLI::Option* option : options) names.push_back("--" + option->get_lnames().front());
  std::sort(names.begin(), names.end());
  return absl::StrJoin(names, ",");
}

inline std::string InterfaceOf(const CLI::Option& option) {
  std::vector<std::string> words =
      option.get_positional() ? std::vector{option.get_name(true)} : std::vector<std::string>();
  for (const std::string& name : option.get_lnames()) words.push_back("--" + name);
  std::string text = absl::StrJoin(words, ",");
  const std::string type = option.get_type_name();
  if (!type.empty() && option.get_expected_max() > 0) absl::StrAppend(&text, " ", type);
  if (option.get_expected_max() > 1) absl::StrAppend(&text, " ...");
  if (!option.get_default_str().empty()) absl::StrAppend(&text, " [", option.get_default_str(), "]");
  if (option.get_required()) absl::StrAppend(&text, " REQUIRED");
  if (!option.get_envname().empty()) absl::StrAppend(&text, " $", option.get_envname());
  if (!option.get_needs().empty()) absl::StrAppend(&text, " needs ", NamesOfOptions(option.get_needs()));
  if (!option.get_excludes().empty())
    absl::StrAppend(&text, " excludes ", NamesOfOptions(option.get_excludes()));
  if (option.get_group().empty()) absl::StrAppend(&text, " HIDDEN");
  return text;
}

// Of a command and of those below it: a line for the words, and an indented one for each option but --help.
inline std::string InterfaceOf(const CLI::App& command, const std::string& words) {
  std::string text = words;
  if (command.get_require_subcommand_min() > 0)
    absl::StrAppend(&text, " COMMAND x ", command.get_require_subcommand_min());
  text += "\n";
  for (const CLI::Option* option : command.get_options())
    if (option != command.get_help_ptr()) absl::StrAppend(&text, "  ", InterfaceOf(*option), "\n");
  for (const CLI::App* one : command.get_subcommands([](const CLI::App*) { return true; }))
    text += InterfaceOf(*one, one->get_name().empty()
                                  ? absl::StrCat(words, ", ", one->get_require_option_min(), " to ",
                                                 one->get_require_option_max(), " of these")
                                  : absl::StrCat(words, " ", one->get_name()));
  return text;
}

}  // namespace weft
