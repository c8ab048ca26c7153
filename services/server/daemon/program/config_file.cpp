#include "services/server/daemon/program/config_file.h"

#include <google/protobuf/text_format.h>

#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/strip.h"
#include "base/status_macros.h"
#include "capture/file/plain_text.h"
#include "services/formats/files/text_file.h"
#include "services/formats/options/first_error.h"
#include "services/ground/process/help.h"
#include "weft/v1/daemon_config.pb.h"

namespace weft {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::TextFormat;

constexpr uint64_t kMaxConfigBytes = uint64_t{1} << 20;
constexpr char kListsOptions[] = "`weftd --print-config` lists all options";
constexpr int kCommentColumns = 110;

std::string OptionOfField(const std::string& field) {
  return absl::StrCat("--", absl::StrReplaceAll(field, {{"_", "-"}}));
}

// Empty: an option that has no place in a file.
std::string FieldOfOption(const CLI::Option& option) {
  if (option.get_lnames().empty()) return "";
  const std::string& name = option.get_lnames()[0];
  for (const char* only_argument : {"help", "version", "config", "print-config"}) {
    if (name == only_argument) return "";
  }
  return absl::StrReplaceAll(name, {{"-", "_"}});
}

std::string ConfigError(const std::string& path, int line, const std::string& problem) {
  return absl::StrCat(EscapedText(path), ":", line, ": ", EscapedText(problem));
}

// Protobuf's words name a field that it does not know between quotes, at the end.
std::string ParserProblem(const std::string& message) {
  constexpr absl::string_view kUnknown = "has no field named \"";
  const size_t at = message.find(kUnknown.data());
  if (at == std::string::npos)
    return absl::StrCat(message, " ", kListsOptions, " with values of their kinds");
  std::string name = message.substr(at + kUnknown.size());
  name = name.substr(0, name.find('"'));
  return absl::StrCat(name, ": no such option; ", kListsOptions);
}

std::vector<std::string> ValuesOfField(const v1::DaemonConfig& config, const FieldDescriptor& field) {
  const google::protobuf::Reflection& reflection = *config.GetReflection();
  std::vector<std::string> values;
  const int count = field.is_repeated() ? reflection.FieldSize(config, &field) : 1;
  for (int i = 0; i < count; ++i) {
    const int index = field.is_repeated() ? i : -1;
    std::string value;
    if (field.cpp_type() != FieldDescriptor::CPPTYPE_STRING) {
      TextFormat::PrintFieldValueToString(config, &field, index, &value);
    } else if (field.is_repeated()) {
      value = reflection.GetRepeatedString(config, &field, i);
    } else {
      value = reflection.GetString(config, &field);
    }
    values.push_back(std::move(value));
  }
  return values;
}

std::string TextValue(const std::string& field, const std::string& value) {
  const FieldDescriptor* known = v1::DaemonConfig::descriptor()->FindFieldByName(field);
  const bool is_text = known == nullptr || known->cpp_type() == FieldDescriptor::CPPTYPE_STRING;
  return is_text ? absl::StrCat("\"", absl::Utf8SafeCEscape(value), "\"") : value;
}

std::string DefaultOf(const CLI::Option& option) {
  const std::string text = option.get_default_str();
  return text == "[]" || text == "{}" ? "" : text;
}

absl::Status Give(CLI::Option& option, const std::vector<std::string>& values) {
  try {
    for (const std::string& value : values) option.add_result(value);
    option.run_callback();
    return absl::OkStatus();
  } catch (const CLI::Error& error) {
    return absl::InvalidArgumentError(absl::StripPrefix(error.what(), absl::StrCat(option.get_name(), ": ")));
  }
}

}  // namespace

absl::Status ApplyConfigFile(const std::string& path, CLI::App& app) {
  WEFT_ASSIGN_OR_RETURN(const std::string text, ReadTextFile(path, kMaxConfigBytes));
  FirstError error;
  TextFormat::ParseInfoTree tree;
  TextFormat::Parser parser;
  parser.RecordErrorsTo(&error);
  parser.WriteLocationsTo(&tree);
  v1::DaemonConfig config;
  if (!parser.ParseFromString(text, &config))
    return absl::InvalidArgumentError(ConfigError(path, error.line(), ParserProblem(error.message())));
  std::vector<const FieldDescriptor*> fields;
  config.GetReflection()->ListFields(config, &fields);
  for (const FieldDescriptor* field : fields) {
    CLI::Option* option = app.get_option_no_throw(OptionOfField(field->name()));
    if (option == nullptr)
      return absl::InternalError(absl::StrCat(field->name(), " is in daemon_config.proto, but no option"));
    if (option->count() > 0) continue;
    if (const absl::Status status = Give(*option, ValuesOfField(config, *field)); !status.ok()) {
      const int line = tree.GetLocation(field, field->is_repeated() ? 0 : -1).line + 1;
      return absl::InvalidArgumentError(ConfigError(
          path, line,
          absl::StrCat(field->name(), ": ", absl::string_view(status.message()), "; ", kListsOptions)));
    }
  }
  return absl::OkStatus();
}

std::string ConfigFileText(const CLI::App& app) {
  std::string text =
      "# proto-file: weft/v1/daemon_config.proto\n"
      "# proto-message: weft.v1.DaemonConfig\n"
      "#\n"
      "# All options of weftd, for `weftd --config FILE`. Lines that are comments show the defaults. "
      "Arguments "
      "have precedence.\n";
  for (const CLI::Option* option : app.get_options()) {
    const std::string field = FieldOfOption(*option);
    if (field.empty()) continue;
    const std::string about = WrapText(option->get_description(), kCommentColumns, 0);
    absl::StrAppend(&text, "\n# ", absl::StrReplaceAll(about, {{"\n", "\n# "}}), "\n");
    if (option->count() == 0) {
      absl::StrAppend(&text, "# ", field, ": ", TextValue(field, DefaultOf(*option)), "\n");
    }
    for (const std::string& value : option->results())
      absl::StrAppend(&text, field, ": ", TextValue(field, value), "\n");
  }
  return text;
}

std::map<std::string, std::string> SettingsOf(const CLI::App& app) {
  std::map<std::string, std::string> settings;
  for (const CLI::Option* option : app.get_options()) {
    const std::string field = FieldOfOption(*option);
    if (field.empty()) continue;
    settings[field] = option->count() > 0 ? absl::StrJoin(option->results(), "\n") : DefaultOf(*option);
  }
  return settings;
}

}  // namespace weft
