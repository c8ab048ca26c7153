// Fields of protobuf's wire format, one after another, without a schema: what is counted before it is kept.
#pragma once

#include <cstdint>
#include <functional>
#include <string_view>

#include "absl/status/status.h"

namespace weft {

struct WireField {
  int number = 0;
  enum class Kind { kNumber, kFourBytes, kBytes } kind = Kind::kNumber;
  uint64_t value = 0;      // kNumber; kFourBytes in its lower half
  std::string_view bytes;  // kBytes
};

// Calls `visit` for each field of a message, until it fails. InvalidArgument: the bytes are no message, or
// have a field of 8 bytes or a group, which no message of ours has; its error otherwise.
absl::Status VisitFields(std::string_view message,
                         const std::function<absl::Status(const WireField&)>& visit);

}  // namespace weft
