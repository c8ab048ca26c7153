#include "services/formats/options/option_text.h"

#include <google/protobuf/text_format.h>

#include <algorithm>
#include <limits>
#include <regex>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "base/nearest_word.h"
#include "base/status_macros.h"
#include "services/formats/files/text_file.h"
#include "services/formats/options/first_error.h"
#include "services/formats/options/option_range.h"

namespace weft {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::TextFormat;

constexpr char kListsAll[] = "`weft options` lists all";

const OptionField* FindOption(std::string_view path) {
  for (const OptionField& option : AllOptions()) {
    if (option.path == path) return &option;
  }
  return nullptr;
}

// Path of the group whose options stand in the message, with a dot behind it; a message is the type of one
// group.
std::string GroupOf(std::string_view message_type) {
  for (const OptionField& option : AllOptions()) {
    if (option.IsGroup() && option.field->message_type()->full_name() == message_type)
      return option.path + ".";
  }
  return "";
}

std::string NoSuchOption(const std::string& path) {
  const std::string nearest = NearestOption(path);
  return absl::StrCat(path, ": no such option; ",
                      nearest.empty() ? "" : absl::StrCat("did you mean ", nearest, "? "), kListsAll);
}

// What protobuf says of a text that it cannot read, in our words where they help.
std::string InOurWords(const std::string& message) {
  static const std::regex unknown("Message type \"([\\w.]+)\" has no field named \"(\\w+)\"\\.?");
  static const std::regex twice("Non-repeated field \"(\\w+)\" is (already )?specified multiple times\\.?");
  std::smatch match;
  if (std::regex_match(message, match, unknown))
    return NoSuchOption(GroupOf(match[1].str()) + match[2].str());
  if (std::regex_match(message, match, twice)) return absl::StrCat(match[1].str(), ": is given twice");
  return message;
}

std::string ValuesOf(const OptionField& option) {
  const FieldDescriptor::CppType type = option.field->cpp_type();
  if (type == FieldDescriptor::CPPTYPE_BOOL) return "true or false";
  const bool whole = type == FieldDescriptor::CPPTYPE_INT32 || type == FieldDescriptor::CPPTYPE_UINT32;
  const std::string range = option.Range();
  return absl::StrCat(whole ? "a whole number" : "a number", range.empty() ? "" : absl::StrCat(" ", range));
}

// Line of an option in a text that was parsed; 0 where it does not tell.
int LineOf(const TextFormat::ParseInfoTree& tree, const OptionField& option) {
  const TextFormat::ParseInfoTree* at = &tree;
  const Descriptor* message = v1::PipelineOptions::descriptor();
  const std::vector<std::string> names = absl::StrSplit(option.path, '.');
  for (size_t i = 0; i + 1 < names.size(); ++i) {
    const FieldDescriptor* field = message->FindFieldByName(names[i]);
    at = at->GetTreeForNested(field, -1);
    if (at == nullptr) return 0;
    message = field->message_type();
  }
  return at->GetLocation(option.field, -1).line + 1;
}

// The message that holds the option, made where it is missing.
Message& OwnerIn(v1::PipelineOptions& options, const std::string& path) {
  Message* message = &options;
  std::vector<std::string> names = absl::StrSplit(path, '.');
  names.pop_back();
  for (const std::string& name : names) {
    message =
        message->GetReflection()->MutableMessage(message, message->GetDescriptor()->FindFieldByName(name));
  }
  return *message;
}

absl::Status CheckStage(const OptionField& option, const std::vector<std::string>& stages,
                        const std::string& setting) {
  const std::string stage = option.path.substr(0, option.path.find('.'));
  if (stages.empty() || std::ranges::count(stages, stage) > 0) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("--set ", setting, ": this command has no stage ", stage,
                                                 ", it has ", absl::StrJoin(stages, ", ")));
}

void AppendGroup(const Message& message, const std::string& prefix, int depth, std::string& text) {
  const std::string indent(2 * depth, ' ');
  const Descriptor& descriptor = *message.GetDescriptor();
  for (int i = 0; i < descriptor.field_count(); ++i) {
    const FieldDescriptor* field = descriptor.field(i);
    if (!message.GetReflection()->HasField(message, field)) continue;
    const OptionField option{prefix + field->name(), field};
    if (depth == 0) text += "\n";
    const std::string range = option.Range();
    absl::StrAppend(&text, indent, "# ", option.About().text(),
                    range.empty() ? "" : absl::StrCat("; ", range), ".\n");
    if (option.IsGroup()) {
      absl::StrAppend(&text, indent, field->name(), " {\n");
      AppendGroup(message.GetReflection()->GetMessage(message, field), option.path + ".", depth + 1, text);
      absl::StrAppend(&text, indent, "}\n");
    } else {
      std::string value;
      TextFormat::PrintFieldValueToString(message, field, -1, &value);
      absl::StrAppend(&text, indent, field->name(), ": ", value, "\n");
    }
  }
}

}  // namespace

absl::Status AddOptionText(const std::string& text, const std::string& source_name,
                           v1::PipelineOptions& options) {
  FirstError error;
  TextFormat::ParseInfoTree tree;
  TextFormat::Parser parser;
  parser.RecordErrorsTo(&error);
  parser.WriteLocationsTo(&tree);
  v1::PipelineOptions added;
  if (!parser.ParseFromString(text, &added)) {
    return absl::InvalidArgumentError(
        absl::StrCat(source_name, ":", error.line(), ": ", InOurWords(error.message())));
  }
  for (const OptionField& option : AllOptions()) {
    if (const std::string problem = RangeProblem(added, option); !problem.empty()) {
      return absl::InvalidArgumentError(
          absl::StrCat(source_name, ":", LineOf(tree, option), ": ", option.path, ": ", problem));
    }
  }
  options.MergeFrom(added);
  return absl::OkStatus();
}

absl::Status AddOptionFile(const std::string& path, v1::PipelineOptions& options) {
  WEFT_ASSIGN_OR_RETURN(const std::string text, ReadTextFile(path, kMaxOptionBytes));
  return AddOptionText(text, path, options);
}

absl::Status AddSetting(const std::string& setting, const std::vector<std::string>& stages,
                        v1::PipelineOptions& options) {
  const auto bad = [&setting](const std::string& why) {
    return absl::InvalidArgumentError(absl::StrCat("--set ", setting, ": ", why));
  };
  const size_t equals = setting.find('=');
  if (equals == std::string::npos)
    return bad("is no OPTION=VALUE, e.g. triangulation.consensus.inlier_radius_mm=1.5");
  const std::string path = setting.substr(0, equals), value = setting.substr(equals + 1);
  const OptionField* option = FindOption(path);
  if (option == nullptr) return absl::InvalidArgumentError(absl::StrCat("--set ", NoSuchOption(path)));
  if (option->IsGroup())
    return bad(absl::StrCat(path, " is a group of options; `weft options ", path, "` lists them"));
  WEFT_RETURN_IF_ERROR(CheckStage(*option, stages, setting));
  v1::PipelineOptions changed = options;
  FirstError error;
  TextFormat::Parser parser;
  parser.RecordErrorsTo(&error);
  Message& owner = OwnerIn(changed, path);
  owner.GetReflection()->ClearField(&owner, option->field);
  if (!parser.ParseFieldValueFromString(value, option->field, &owner))
    return bad(absl::StrCat("must be ", ValuesOf(*option)));
  if (!RangeProblem(changed, *option).empty()) return bad(absl::StrCat("must be ", ValuesOf(*option)));
  options = changed;
  return absl::OkStatus();
}

std::string NearestOption(std::string_view name) {
  const std::string wanted(name);
  const std::string last = wanted.substr(wanted.rfind('.') == std::string::npos ? 0 : wanted.rfind('.') + 1);
  std::string nearest;
  std::pair<size_t, size_t> least{std::numeric_limits<size_t>::max(), 0};
  for (const OptionField& option : AllOptions()) {
    if (option.IsGroup()) continue;
    // A letter may be wrong, or the groups in front of the name.
    const size_t whole = EditDistance(wanted, option.path),
                 end = EditDistance(last, option.field->name()) + 1;
    const std::pair distance{std::min(whole, end), whole};
    if (distance >= least) continue;
    least = distance;
    nearest = option.path;
  }
  return least.first <= std::max<size_t>(3, last.size() / 2) ? nearest : "";
}

std::string OptionFileText(const v1::PipelineOptions& options) {
  std::string text =
      "# proto-file: weft/v1/options.proto\n"
      "# proto-message: weft.v1.PipelineOptions\n"
      "#\n"
      "# Every option, for --config. Lines may be left out: what a file does not name stays as the preset "
      "has it.\n";
  AppendGroup(options, "", 0, text);
  return text;
}

}  // namespace weft
