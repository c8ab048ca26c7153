#include "services/formats/files/enum_words.h"

#include <google/protobuf/descriptor.h>

#include "absl/strings/ascii.h"
#include "absl/strings/str_replace.h"

namespace weft {

std::map<int, std::string> EnumWords(const google::protobuf::EnumDescriptor& type) {
  const size_t prefix = type.FindValueByNumber(0)->name().size() - sizeof "UNSPECIFIED" + 1;
  std::map<int, std::string> words;
  for (int i = 0; i < type.value_count(); ++i) {
    const google::protobuf::EnumValueDescriptor& value = *type.value(i);
    const std::string name = absl::AsciiStrToLower(value.name().substr(prefix));
    if (value.number() != 0) words[value.number()] = absl::StrReplaceAll(name, {{"_", " "}});
  }
  return words;
}

}  // namespace weft
