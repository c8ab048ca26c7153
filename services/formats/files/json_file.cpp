#include "services/formats/files/json_file.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/util/json_util.h>

#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/str_split.h"
#include "base/status_macros.h"
#include "capture/file/plain_text.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_kinds.h"
#include "services/formats/files/text_file.h"

namespace weft {
namespace {

absl::StatusOr<std::string_view> JsonOf(std::string_view text, const std::string& source_name) {
  WEFT_RETURN_IF_ERROR(CheckEncoding(text, source_name));
  return WithoutByteOrderMark(text);
}

using google::protobuf::FieldDescriptor;

// The field at a place of protobuf's messages, "cameras[0].gige.device"; null where there is none.
const FieldDescriptor* FieldAt(const google::protobuf::Descriptor* type, const std::string& place) {
  const FieldDescriptor* field = nullptr;
  for (absl::string_view part : absl::StrSplit(place, '.')) {
    if (type == nullptr) return nullptr;
    const std::string name(part.substr(0, part.find('[')));
    field = type->FindFieldByName(name);
    if (field == nullptr) field = type->FindFieldByCamelcaseName(name);
    if (field == nullptr) return nullptr;
    type = field->message_type();
  }
  return field;
}

// "; it is one of A, B" where the complaint is about a field of few values.
std::string KnownValues(const std::string& why, const google::protobuf::Message& message) {
  const size_t from = why.find('('), to = why.find("): invalid value");
  if (from == std::string::npos || to == std::string::npos || to < from) return "";
  const FieldDescriptor* field = FieldAt(message.GetDescriptor(), why.substr(from + 1, to - from - 1));
  if (field == nullptr || field->enum_type() == nullptr) return "";
  std::vector<std::string> names;
  for (int i = 0; i < field->enum_type()->value_count(); ++i)
    if (field->enum_type()->value(i)->number() != 0) names.push_back(field->enum_type()->value(i)->name());
  return absl::StrCat("; it is one of ", absl::StrJoin(names, ", "));
}

}  // namespace

absl::Status CheckJsonLimits(std::string_view text, const std::string& source_name,
                             const JsonLimits& limits) {
  const auto more_than = [&](const std::string& has, const std::string& may) {
    return absl::InvalidArgumentError(
        absl::StrCat(source_name, ": has ", has, ", and a JSON file of this kind may have ", may));
  };
  if (text.size() > limits.bytes)
    return more_than(absl::StrCat(text.size(), " bytes"), absl::StrCat(limits.bytes, " at most"));
  uint64_t values = 0;
  int depth = 0;
  for (size_t i = 0; i < text.size(); ++i) {
    const char letter = text[i];
    if (letter == '"') {  // to its end
      for (++i; i < text.size() && text[i] != '"'; ++i) i += text[i] == '\\' ? 1 : 0;
    } else if (letter == '{' || letter == '[') {
      ++values;
      if (++depth > limits.depth)
        return more_than("objects and arrays in each other deeper than that", absl::StrCat(limits.depth));
    } else if (letter == '}' || letter == ']') {
      --depth;
    } else if (letter == ',') {
      ++values;
    }
    if (values > limits.values) return more_than("more values", absl::StrCat(limits.values, " at most"));
  }
  return absl::OkStatus();
}

absl::Status ParseJson(std::string_view text, const std::string& source_name,
                       google::protobuf::Message& message, const JsonLimits& limits) {
  WEFT_RETURN_IF_ERROR(CheckJsonLimits(text, source_name, limits));
  WEFT_ASSIGN_OR_RETURN(const std::string_view json, JsonOf(text, source_name));
  google::protobuf::util::JsonParseOptions options;
  options.ignore_unknown_fields = false;
  const auto status = google::protobuf::util::JsonStringToMessage(
      google::protobuf::StringPiece(json.data(), json.size()), &message, options);
  if (status.ok()) return absl::OkStatus();
  if (const std::string other = OtherKind(json, message); !other.empty())
    return absl::InvalidArgumentError(absl::StrCat(source_name, ": ", other));
  // One line: the message shows the place in the text and points to it from the line below.
  const std::string why(status.message().data(), status.message().size());
  const std::string line =
      absl::StrReplaceAll(why.substr(0, why.find_last_not_of(" ^\n") + 1),
                          {{"Cannot find field.", "unknown field; check its spelling or remove it"},
                           {".\n", " near: "},
                           {"\n", " "}});
  constexpr size_t kMostQuoted = 500;
  return absl::InvalidArgumentError(
      absl::StrCat(source_name, ": ", MessageText(line, kMostQuoted), KnownValues(why, message)));
}

absl::StatusOr<std::string> ToJson(const google::protobuf::Message& message, JsonZeros zeros) {
  google::protobuf::util::JsonPrintOptions options;
  options.add_whitespace = true;
  options.always_print_primitive_fields = zeros == JsonZeros::kWritten;
  options.preserve_proto_field_names = true;
  std::string text;
  const auto status = google::protobuf::util::MessageToJsonString(message, &text, options);
  if (!status.ok()) {
    const auto why = status.message();
    return absl::InternalError(absl::StrCat(message.GetDescriptor()->name(), ": cannot be written as JSON: ",
                                            absl::string_view(why.data(), why.size())));
  }
  if (text.empty() || text.back() != '\n') text += '\n';
  return text;
}

absl::Status ReadJsonFile(const std::string& path, google::protobuf::Message& message,
                          const JsonLimits& limits) {
  WEFT_ASSIGN_OR_RETURN(const std::string text, ReadWholeFile(path, limits.bytes));
  return ParseJson(text, path, message, limits);
}

absl::Status WriteJsonFile(const std::string& path, const google::protobuf::Message& message,
                           JsonZeros zeros) {
  WEFT_ASSIGN_OR_RETURN(const std::string text, ToJson(message, zeros));
  return WriteFileAtomically(path, text);
}

}  // namespace weft
