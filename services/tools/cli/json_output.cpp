#include "services/tools/cli/json_output.h"

#include <cstdio>

#include "base/status_macros.h"
#include "services/formats/files/json_file.h"

namespace weft {

absl::Status PrintJsonMessage(const google::protobuf::Message& message) {
  WEFT_ASSIGN_OR_RETURN(const std::string json, ToJson(message));
  std::fputs(json.c_str(), stdout);
  return absl::OkStatus();
}

absl::Status PrintMessage(const google::protobuf::Message& message, bool as_json, const std::string& text) {
  if (as_json) return PrintJsonMessage(message);
  std::fputs(text.c_str(), stdout);
  return absl::OkStatus();
}

}  // namespace weft
