// Messages of proto/ as JSON text. Field names are the proto field names; unknown fields are errors.
#pragma once

#include <google/protobuf/message.h>

#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace weft {

// The largest JSON file that is read.
inline constexpr uint64_t kMaxJsonBytes = uint64_t{64} << 20;

// Fills `message` from JSON text. InvalidArgument names source_name and the field.
absl::Status ParseJson(std::string_view text, const std::string& source_name,
                       google::protobuf::Message& message);

// Zeros of fields without presence (those not `optional`): written, or left out, which keeps the fields in
// the order of their numbers.
enum class JsonZeros { kWritten, kOmitted };

// Indented JSON with a newline at the end.
absl::StatusOr<std::string> ToJson(const google::protobuf::Message& message,
                                   JsonZeros zeros = JsonZeros::kWritten);

// The same on files: errors of ReadWholeFile and WriteFileAtomically besides.
absl::Status ReadJsonFile(const std::string& path, google::protobuf::Message& message);
absl::Status WriteJsonFile(const std::string& path, const google::protobuf::Message& message,
                           JsonZeros zeros = JsonZeros::kWritten);

}  // namespace weft
