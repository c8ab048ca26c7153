#include "services/tools/cli/completion.h"

#include <algorithm>
#include <functional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/str_split.h"

namespace weft {
namespace {

using NamedWord = std::pair<std::string, std::string>;  // and what it does

struct CompletedOption {
  std::vector<std::string> names;
  std::string about;
  std::vector<std::string> values;  // empty: any
};

struct CompletedCommand {
  std::string path;  // "weft take record"
  std::vector<NamedWord> commands;
  std::vector<CompletedOption> options;
};

// The first sentence, in one line.
std::string Gist(const std::string& text) {
  const std::string first = text.substr(0, text.find(". "));
  return first.substr(0, first.find('\n'));
}

// "{a,b,c}" behind the name of the type is how CLI11 shows a set.
std::vector<std::string> ValuesOf(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const size_t begin = type.find('{'), end = type.find('}');
  if (begin == std::string::npos || end == std::string::npos || end < begin) return {};
  return absl::StrSplit(type.substr(begin + 1, end - begin - 1), ',');
}

std::vector<const CLI::App*> CommandsOf(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App*) { return true; });
}

// Options of the commands around it are understood as well.
std::vector<CompletedOption> OptionsOf(const CLI::App& app) {
  std::vector<CompletedOption> found;
  std::function<void(const CLI::App&)> add = [&](const CLI::App& from) {
    for (const CLI::Option* option : from.get_options()) {
      if (option->get_positional() && option->get_lnames().empty()) continue;
      if (&from != &app && option == from.get_help_ptr()) continue;  // the command has it already
      CompletedOption one{{}, Gist(option->get_description()), ValuesOf(*option)};
      for (const std::string& name : option->get_snames()) one.names.push_back("-" + name);
      for (const std::string& name : option->get_lnames()) one.names.push_back("--" + name);
      if (!one.names.empty()) found.push_back(std::move(one));
    }
    for (const CLI::App* part : CommandsOf(from)) {
      if (part->get_name().empty()) add(*part);  // an option group
    }
  };
  add(app);
  if (const CLI::App* parent = app.get_parent()) {
    for (CompletedOption& option : OptionsOf(*parent)) {
      const bool known = std::ranges::any_of(
          found, [&](const CompletedOption& other) { return other.names.back() == option.names.back(); });
      if (!known) found.push_back(std::move(option));
    }
  }
  return found;
}

void AddCommands(const CLI::App& app, const std::string& path, std::vector<CompletedCommand>& out) {
  CompletedCommand command{path, {}, OptionsOf(app)};
  for (const CLI::App* sub : CommandsOf(app)) {
    if (!sub->get_name().empty())
      command.commands.emplace_back(sub->get_name(), Gist(sub->get_description()));
  }
  out.push_back(std::move(command));
  for (const CLI::App* sub : CommandsOf(app)) {
    if (!sub->get_name().empty()) AddCommands(*sub, absl::StrCat(path, " ", sub->get_name()), out);
  }
}

std::vector<CompletedCommand> AllCommands(const CLI::App& app) {
  std::vector<CompletedCommand> commands;
  AddCommands(app, app.get_name(), commands);
  return commands;
}

std::string Quoted(const std::string& text) {
  return absl::StrCat("'", absl::StrReplaceAll(text, {{"'", "'\\''"}}), "'");
}

// In a pattern of `case`.
std::string PathPattern(const std::vector<CompletedCommand>& commands) {
  std::vector<std::string> paths;
  for (size_t i = 1; i < commands.size(); ++i) paths.push_back(Quoted(commands[i].path));
  return absl::StrJoin(paths, "|");
}

// The patterns "command option" of options with values, and these.
std::vector<std::pair<std::string, std::vector<std::string>>> ValueCases(
    const std::vector<CompletedCommand>& commands) {
  std::vector<std::pair<std::string, std::vector<std::string>>> cases;
  for (const CompletedCommand& command : commands) {
    for (const CompletedOption& option : command.options) {
      if (option.values.empty()) continue;
      std::vector<std::string> patterns;
      for (const std::string& name : option.names)
        patterns.push_back(Quoted(absl::StrCat(command.path, " ", name)));
      cases.emplace_back(absl::StrJoin(patterns, "|"), option.values);
    }
  }
  return cases;
}

// 'name:what it does', with the colons of the name escaped.
std::string Described(const std::string& name, const std::string& about) {
  return Quoted(absl::StrCat(absl::StrReplaceAll(name, {{":", "\\:"}}), ":", about));
}

}  // namespace

std::string BashCompletion(const CLI::App& app) {
  const std::vector<CompletedCommand> commands = AllCommands(app);
  const std::string function = "_" + app.get_name();
  std::string out = absl::StrCat(
      "# Completion of ", app.get_name(), " for bash, as `", app.get_name(), " completion bash` prints it.\n",
      function,
      "() {\n  local word=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD-1]}\n"
      "  local command=",
      app.get_name(),
      " commands= options= i\n"
      "  COMPREPLY=()\n"
      "  for ((i = 1; i < COMP_CWORD; ++i)); do\n"
      "    case \"$command ${COMP_WORDS[i]}\" in\n      ",
      PathPattern(commands),
      ") command+=\" ${COMP_WORDS[i]}\" ;;\n    esac\n  done\n  case \"$command $previous\" in\n");
  for (const auto& [pattern, values] : ValueCases(commands)) {
    absl::StrAppend(&out, "    ", pattern, ") COMPREPLY=($(compgen -W ", Quoted(absl::StrJoin(values, " ")),
                    " -- \"$word\")); return ;;\n");
  }
  absl::StrAppend(&out, "  esac\n  case $command in\n");
  for (const CompletedCommand& command : commands) {
    std::vector<std::string> names, options;
    for (const NamedWord& sub : command.commands) names.push_back(sub.first);
    for (const CompletedOption& option : command.options) {
      options.insert(options.end(), option.names.begin(), option.names.end());
    }
    absl::StrAppend(&out, "    ", Quoted(command.path), ") commands=", Quoted(absl::StrJoin(names, " ")),
                    " options=", Quoted(absl::StrJoin(options, " ")), " ;;\n");
  }
  absl::StrAppend(
      &out,
      "  esac\n"
      "  if [[ $word == -* ]]; then\n    COMPREPLY=($(compgen -W \"$options\" -- \"$word\"))\n"
      "  elif [[ -n $commands ]]; then\n    COMPREPLY=($(compgen -W \"$commands\" -- \"$word\"))\n  fi\n}\n"
      "complete -o default -F ",
      function, " ", app.get_name(), "\n");
  return out;
}

std::string ZshCompletion(const CLI::App& app) {
  const std::vector<CompletedCommand> commands = AllCommands(app);
  std::string out = absl::StrCat(
      "#compdef ", app.get_name(), "\n# Completion of ", app.get_name(), " for zsh, as `", app.get_name(),
      " completion zsh` prints it.\n"
      "local command=",
      app.get_name(),
      " word\nlocal -a commands options\n"
      "for word in ${words[2,CURRENT-1]}; do\n  case \"$command $word\" in\n    (",
      PathPattern(commands),
      ") command+=\" $word\" ;;\n  esac\ndone\ncase \"$command ${words[CURRENT-1]}\" in\n");
  for (const auto& [pattern, values] : ValueCases(commands)) {
    absl::StrAppend(&out, "  (", pattern, ") compadd -- ", absl::StrJoin(values, " "), "; return ;;\n");
  }
  absl::StrAppend(&out, "esac\ncase $command in\n");
  for (const CompletedCommand& command : commands) {
    std::vector<std::string> names, options;
    for (const auto& [name, about] : command.commands) names.push_back(Described(name, about));
    for (const CompletedOption& option : command.options) {
      for (const std::string& name : option.names) options.push_back(Described(name, option.about));
    }
    absl::StrAppend(&out, "  (", Quoted(command.path), ")\n    commands=(", absl::StrJoin(names, " "),
                    ")\n    options=(", absl::StrJoin(options, "\n      "), ") ;;\n");
  }
  absl::StrAppend(&out,
                  "esac\n"
                  "if [[ $PREFIX == -* ]]; then\n  _describe option options\n"
                  "elif (( $#commands )); then\n  _describe command commands\nelse\n  _files\nfi\n");
  return out;
}

}  // namespace weft
