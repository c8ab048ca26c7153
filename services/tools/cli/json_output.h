// Messages as JSON, for those who read a command's output with a program.
#pragma once

#include "absl/status/status.h"

namespace google::protobuf {
class Message;
}

namespace weft {

// On standard output.
absl::Status PrintJsonMessage(const google::protobuf::Message& message);

}  // namespace weft
