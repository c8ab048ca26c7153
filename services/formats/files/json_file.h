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

// What is looked at before anything is parsed: a parser takes up to 300 bytes for one of a text that is made
// to have many or deep values.
struct JsonLimits {
  uint64_t bytes = kMaxJsonBytes;
  uint64_t values = 4'000'000;  // objects, arrays and their members
  int depth = 60;               // of objects and arrays in each other
};
// Of a take's files, which a daemon reads in its own process, and of rigs, boards and templates.
inline constexpr JsonLimits kSmallJson = {.bytes = uint64_t{16} << 20, .values = 200'000};
inline constexpr JsonLimits kInputJson = {.values = 1'000'000};

// InvalidArgument names source_name and the limit; the text may be no JSON otherwise.
absl::Status CheckJsonLimits(std::string_view text, const std::string& source_name, const JsonLimits& limits);

// Fills `message` from JSON text. InvalidArgument names source_name and the field.
absl::Status ParseJson(std::string_view text, const std::string& source_name,
                       google::protobuf::Message& message, const JsonLimits& limits = {});

// Zeros of fields without presence (those not `optional`): written, or left out, which keeps the fields in
// the order of their numbers.
enum class JsonZeros { kWritten, kOmitted };

// Indented JSON with a newline at the end.
absl::StatusOr<std::string> ToJson(const google::protobuf::Message& message,
                                   JsonZeros zeros = JsonZeros::kWritten);

// The same on files: errors of ReadWholeFile and WriteFileAtomically besides.
absl::Status ReadJsonFile(const std::string& path, google::protobuf::Message& message,
                          const JsonLimits& limits = {});
absl::Status WriteJsonFile(const std::string& path, const google::protobuf::Message& message,
                           JsonZeros zeros = JsonZeros::kWritten);

}  // namespace weft
