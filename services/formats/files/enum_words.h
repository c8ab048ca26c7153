// Values of protobuf's enums in words.
#pragma once

#include <google/protobuf/generated_enum_reflection.h>

#include <map>
#include <string>

namespace weft {

// All but UNSPECIFIED, without what the names of an enum begin with: "taken over" of
// CAPTURE_SESSION_STATE_TAKEN_OVER.
std::map<int, std::string> EnumWords(const google::protobuf::EnumDescriptor& type);

// `otherwise`: of UNSPECIFIED, and of values that the schema lacks.
template <typename Enum>
const char* EnumWord(Enum value, const char* otherwise) {
  // Never destroyed: calls may end while the program does.
  static const auto& words = *new std::map(EnumWords(*google::protobuf::GetEnumDescriptor<Enum>()));
  const auto found = words.find(value);
  return found == words.end() ? otherwise : found->second.c_str();
}

}  // namespace weft
