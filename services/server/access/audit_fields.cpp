#include "services/server/access/audit_fields.h"

#include <algorithm>
#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "capture/file/plain_text.h"

namespace weft {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

constexpr int kMostFields = 16, kMostOfOneField = 4, kDeepest = 4;
constexpr size_t kLongestValue = 200;

// Of a field that is no message; element -1: it is not repeated.
std::string ValueText(const Message& message, const FieldDescriptor& field, int element) {
  const google::protobuf::Reflection& reflection = *message.GetReflection();
  const bool one = element < 0;
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_STRING:
      return one ? reflection.GetString(message, &field)
                 : reflection.GetRepeatedString(message, &field, element);
    case FieldDescriptor::CPPTYPE_ENUM:
      return one ? reflection.GetEnum(message, &field)->name()
                 : reflection.GetRepeatedEnum(message, &field, element)->name();
    case FieldDescriptor::CPPTYPE_BOOL:
      return !one || reflection.GetBool(message, &field) ? "true" : "";
    case FieldDescriptor::CPPTYPE_INT32:
      return one ? absl::StrCat(reflection.GetInt32(message, &field)) : "";
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return one ? absl::StrCat(reflection.GetDouble(message, &field)) : "";
    default:
      return "";
  }
}

class Describer {
 public:
  explicit Describer(v1::AuditEntry& entry) : about_(*entry.mutable_about()) {}

  void Add(const Message& message, const std::string& prefix, int depth) {
    std::vector<const FieldDescriptor*> set;
    message.GetReflection()->ListFields(message, &set);
    for (const FieldDescriptor* field : set) {
      if (!field->options().GetExtension(v1::secret)) AddField(message, *field, {prefix, depth});
    }
  }

 private:
  struct Place {
    std::string prefix;
    int depth = 0;
  };

  void AddField(const Message& message, const FieldDescriptor& field, const Place& place) {
    const std::string name = absl::StrCat(place.prefix, field.name());
    if (!field.is_repeated()) return AddElement(message, field, -1, {name, place.depth});
    const int size = std::min(kMostOfOneField, message.GetReflection()->FieldSize(message, &field));
    for (int i = 0; i < size; ++i) AddElement(message, field, i, {absl::StrCat(name, ".", i), place.depth});
  }

  void AddElement(const Message& message, const FieldDescriptor& field, int element, const Place& place) {
    if (about_.size() >= kMostFields) return;
    if (field.cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) {
      const std::string value = ValueText(message, field, element).substr(0, kLongestValue);
      if (!value.empty()) about_[place.prefix] = EscapedText(value);
      return;
    }
    if (place.depth >= kDeepest) return;
    const google::protobuf::Reflection& reflection = *message.GetReflection();
    Add(element < 0 ? reflection.GetMessage(message, &field)
                    : reflection.GetRepeatedMessage(message, &field, element),
        absl::StrCat(place.prefix, "."), place.depth + 1);
  }

  google::protobuf::Map<std::string, std::string>& about_;
};

}  // namespace

void DescribeRequest(const Message& request, v1::AuditEntry& entry) { Describer(entry).Add(request, "", 0); }

void DescribeAnswer(const Message& answer, v1::AuditEntry& entry) {
  std::vector<const FieldDescriptor*> set;
  answer.GetReflection()->ListFields(answer, &set);
  for (const FieldDescriptor* field : set) {
    const bool is_id = field->name() == "id" || absl::EndsWith(field->name(), "_id");
    if (!is_id || field->is_repeated() || field->cpp_type() != FieldDescriptor::CPPTYPE_STRING) continue;
    (*entry.mutable_about())[field->name()] =
        EscapedText(answer.GetReflection()->GetString(answer, field).substr(0, kLongestValue));
  }
}

}  // namespace weft
