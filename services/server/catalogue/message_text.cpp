#include "services/server/catalogue/message_text.h"

#include <vector>

#include "capture/file/plain_text.h"
#include "google/protobuf/descriptor.h"
#include "google/protobuf/unknown_field_set.h"

namespace weft {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Reflection;
using google::protobuf::UnknownField;
using google::protobuf::UnknownFieldSet;

// The same on the bytes of a message: fields as they are on the wire, which any text may be.
void EscapeFields(const Descriptor& type, UnknownFieldSet& fields) {
  for (int i = 0; i < fields.field_count(); ++i) {
    UnknownField& field = *fields.mutable_field(i);
    const FieldDescriptor* known = type.FindFieldByNumber(field.number());
    if (known == nullptr || field.type() != UnknownField::TYPE_LENGTH_DELIMITED) continue;
    std::string& bytes = *field.mutable_length_delimited();
    if (known->type() == FieldDescriptor::TYPE_STRING) {
      if (!IsUtf8(bytes)) bytes = EscapedText(bytes);
    } else if (known->type() == FieldDescriptor::TYPE_MESSAGE) {
      UnknownFieldSet inner;
      if (!inner.ParseFromString(bytes)) continue;
      EscapeFields(*known->message_type(), inner);
      inner.SerializeToString(&bytes);
    }
  }
}

}  // namespace

void EscapeTexts(google::protobuf::Message& message) {
  const Reflection& reflection = *message.GetReflection();
  std::vector<const FieldDescriptor*> fields;
  reflection.ListFields(message, &fields);
  for (const FieldDescriptor* field : fields) {
    const int count = field->is_repeated() ? reflection.FieldSize(message, field) : 1;
    for (int i = 0; i < count; ++i) {
      if (field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
        EscapeTexts(field->is_repeated() ? *reflection.MutableRepeatedMessage(&message, field, i)
                                         : *reflection.MutableMessage(&message, field));
      } else if (field->type() == FieldDescriptor::TYPE_STRING) {
        const std::string text = field->is_repeated() ? reflection.GetRepeatedString(message, field, i)
                                                      : reflection.GetString(message, field);
        if (IsUtf8(text)) continue;
        field->is_repeated() ? reflection.SetRepeatedString(&message, field, i, EscapedText(text))
                             : reflection.SetString(&message, field, EscapedText(text));
      }
    }
  }
}

bool ParseWithEscapes(const std::string& bytes, google::protobuf::Message& message) {
  if (message.ParseFromString(bytes)) return true;
  UnknownFieldSet fields;
  if (!fields.ParseFromString(bytes)) return false;
  EscapeFields(*message.GetDescriptor(), fields);
  std::string escaped;
  return fields.SerializeToString(&escaped) && message.ParseFromString(escaped);
}

}  // namespace weft
