#include "services/server/catalogue/message_text.h"

#include "capture/file/plain_text.h"
#include "google/protobuf/descriptor.h"
#include "google/protobuf/unknown_field_set.h"

namespace weft {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::UnknownField;
using google::protobuf::UnknownFieldSet;

// Fields as they are on the wire, which any text may be.
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
  ParseWithEscapes(std::string(message.SerializeAsString()), message);
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
