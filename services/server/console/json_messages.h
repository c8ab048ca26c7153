// The API's messages as the JSON of browsers, by the schemas alone: no code knows a method.
#pragma once

#include <google/protobuf/descriptor.h>

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace weft {

// "Takes.WatchTake" or "Takes/WatchTake" of weft.v1. Null: there is none, or its client streams.
const google::protobuf::MethodDescriptor* FindMethod(std::string_view name);

// Protobuf's JSON (names in camel case, 64-bit numbers as text) as the wire has it. InvalidArgument says what
// is wrong, and where.
absl::StatusOr<std::string> RequestOfJson(const google::protobuf::Descriptor& type, std::string_view json);
// From names and values, for requests without a body: fields that are text, numbers or enums.
absl::StatusOr<std::string> RequestOfQuery(const google::protobuf::Descriptor& type,
                                           const std::vector<std::pair<std::string, std::string>>& query);
absl::StatusOr<std::string> JsonOfAnswer(const google::protobuf::Descriptor& type, std::string_view bytes);

// A ConsoleError.
std::string JsonOfStatus(const absl::Status& status);
std::string JsonOf(const google::protobuf::Message& message);
absl::Status FromJson(std::string_view json, google::protobuf::Message& message);

}  // namespace weft
