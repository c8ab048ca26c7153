#include "services/tools/cli/json_output.h"

#include <cstdio>

#include "services/formats/files/json_file.h"

namespace weft {

absl::Status PrintJsonMessage(const google::protobuf::Message& message) {
  const absl::StatusOr<std::string> json = ToJson(message);
  if (!json.ok()) return json.status();
  std::fputs(json->c_str(), stdout);
  return absl::OkStatus();
}

}  // namespace weft
