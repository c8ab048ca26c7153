// Messages as JSON, for those who read a command's output with a program.
#pragma once

#include <string>

#include "absl/status/status.h"

namespace google::protobuf {
class Message;
}

namespace weft {

// On standard output.
absl::Status PrintJsonMessage(const google::protobuf::Message& message);

// The same, or the text that says it to people.
absl::Status PrintMessage(const google::protobuf::Message& message, bool as_json, const std::string& text);

}  // namespace weft
