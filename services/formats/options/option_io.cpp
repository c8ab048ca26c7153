#include "services/formats/options/option_io.h"

#include <google/protobuf/descriptor.h>

#include <stdexcept>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

const FieldDescriptor* FieldOf(const Message& message, const char* name, FieldDescriptor::CppType type) {
  const FieldDescriptor* field = message.GetDescriptor()->FindFieldByName(name);
  if (field != nullptr && field->cpp_type() == type) return field;
  throw std::logic_error(absl::StrCat(message.GetDescriptor()->full_name(), " has no such field ", name));
}

// One scalar, by the accessors of its type.
template <typename T, typename Field>
void Move(const Message* read, Message* write, const FieldDescriptor* field,
          Field (Reflection::*get)(const Message&, const FieldDescriptor*) const,
          void (Reflection::*set)(Message*, const FieldDescriptor*, Field) const, T& value) {
  const Reflection& reflection = *read->GetReflection();
  if (write != nullptr) {
    (reflection.*set)(write, field, static_cast<Field>(value));
  } else if (reflection.HasField(*read, field)) {
    value = static_cast<T>((reflection.*get)(*read, field));
  }
}

}  // namespace

OptionIo OptionIo::At(const char* group) const {
  const FieldDescriptor* field = FieldOf(*read_, group, FieldDescriptor::CPPTYPE_MESSAGE);
  const Reflection& reflection = *read_->GetReflection();
  if (write_ != nullptr) return Writing(*reflection.MutableMessage(write_, field));
  return Reading(reflection.GetMessage(*read_, field));
}

void OptionIo::operator()(const char* name, bool& value) const {
  Move(read_, write_, FieldOf(*read_, name, FieldDescriptor::CPPTYPE_BOOL), &Reflection::GetBool,
       &Reflection::SetBool, value);
}

void OptionIo::operator()(const char* name, int& value) const {
  Move(read_, write_, FieldOf(*read_, name, FieldDescriptor::CPPTYPE_INT32), &Reflection::GetInt32,
       &Reflection::SetInt32, value);
}

void OptionIo::operator()(const char* name, float& value) const {
  Move(read_, write_, FieldOf(*read_, name, FieldDescriptor::CPPTYPE_FLOAT), &Reflection::GetFloat,
       &Reflection::SetFloat, value);
}

void OptionIo::operator()(const char* name, double& value) const {
  Move(read_, write_, FieldOf(*read_, name, FieldDescriptor::CPPTYPE_DOUBLE), &Reflection::GetDouble,
       &Reflection::SetDouble, value);
}

void OptionIo::operator()(const char* name, uint64_t& value) const {
  Move(read_, write_, FieldOf(*read_, name, FieldDescriptor::CPPTYPE_UINT32), &Reflection::GetUInt32,
       &Reflection::SetUInt32, value);
}

}  // namespace weft
