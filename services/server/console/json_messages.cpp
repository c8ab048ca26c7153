#include "services/server/console/json_messages.h"

#include <google/protobuf/message.h>
#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <memory>
#include <optional>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/file/plain_text.h"
#include "services/formats/files/json_file.h"
#include "services/server/rpc/error_detail.h"
#include "services/server/rpc/service_files.h"
#include "weft/v1/console.pb.h"

namespace weft {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

std::unique_ptr<Message> NewMessage(const Descriptor& type) {
  return std::unique_ptr<Message>(
      google::protobuf::MessageFactory::generated_factory()->GetPrototype(&type)->New());
}

// False: the text is no value of the field.
bool SetField(const FieldDescriptor& field, const std::string& text, Message& message) {
  const Reflection& reflection = *message.GetReflection();
  int64_t number = 0;
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_STRING:
      reflection.SetString(&message, &field, text);
      return field.type() == FieldDescriptor::TYPE_STRING;
    case FieldDescriptor::CPPTYPE_INT64:
      if (!absl::SimpleAtoi(text, &number)) return false;
      reflection.SetInt64(&message, &field, number);
      return true;
    case FieldDescriptor::CPPTYPE_ENUM: {
      const auto* value = field.enum_type()->FindValueByName(text);
      if (value != nullptr) reflection.SetEnum(&message, &field, value);
      return value != nullptr;
    }
    default:
      return false;
  }
}

}  // namespace

const google::protobuf::MethodDescriptor* FindMethod(std::string_view name) {
  std::string wanted(name);
  std::ranges::replace(wanted, '/', '.');
  static const auto& methods = *new std::vector(ServiceMethods());
  for (const google::protobuf::MethodDescriptor* method : methods) {
    const std::string known = absl::StrCat(method->service()->name(), ".", method->name());
    if (known == wanted) return method->client_streaming() ? nullptr : method;
  }
  return nullptr;
}

absl::Status FromJson(std::string_view json, Message& message) {
  // Also of browsers that nobody knows yet: a megabyte of brackets would take 300.
  constexpr JsonLimits kRequest = {.bytes = uint64_t{1} << 20, .values = 20'000, .depth = 30};
  WEFT_RETURN_IF_ERROR(CheckJsonLimits(json, "the request", kRequest));
  google::protobuf::util::JsonParseOptions options;
  options.ignore_unknown_fields = false;
  const auto status =
      google::protobuf::util::JsonStringToMessage({json.data(), json.size()}, &message, options);
  if (status.ok()) return absl::OkStatus();
  return absl::InvalidArgumentError(EscapedText(std::string(status.message())));
}

absl::StatusOr<std::string> RequestOfJson(const Descriptor& type, std::string_view json) {
  const std::unique_ptr<Message> message = NewMessage(type);
  WEFT_RETURN_IF_ERROR(FromJson(json, *message));
  return message->SerializeAsString();
}

absl::StatusOr<std::string> RequestOfQuery(const Descriptor& type,
                                           const std::vector<std::pair<std::string, std::string>>& query) {
  const std::unique_ptr<Message> message = NewMessage(type);
  for (const auto& [name, value] : query) {
    const FieldDescriptor* field = type.FindFieldByName(name);
    if (field == nullptr || field->is_repeated() || !IsUtf8(value) || !SetField(*field, value, *message)) {
      return absl::InvalidArgumentError(
          absl::StrCat(EscapedText(name), ": \"", EscapedText(value), "\" is no value of ", type.name()));
    }
  }
  return message->SerializeAsString();
}

absl::StatusOr<std::string> JsonOfAnswer(const Descriptor& type, std::string_view bytes) {
  const std::unique_ptr<Message> message = NewMessage(type);
  if (!message->ParseFromArray(bytes.data(), static_cast<int>(bytes.size())))
    return absl::InternalError(absl::StrCat("the answer is no ", type.name()));
  return JsonOf(*message);
}

std::string JsonOf(const Message& message) {
  std::string json;
  // Only invalid UTF-8 can fail, which protobuf accepts in no message.
  if (!google::protobuf::util::MessageToJsonString(message, &json).ok()) return "{}";
  return json;
}

std::string JsonOfStatus(const absl::Status& status) {
  v1::ConsoleError error;
  error.set_code(absl::StatusCodeToString(status.code()));
  error.set_message(EscapedText(std::string(status.message())));
  if (const std::optional<v1::ErrorDetail> detail = DetailOf(status)) {
    error.set_field(detail->field());
    error.set_remedy(detail->remedy());
  }
  return JsonOf(error);
}

}  // namespace weft
