// Refusals that say when to come again.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>

#include "absl/status/status.h"

namespace weft {

// "MESSAGE; retry after 250 ms". It stands in the message, since refusals before a method begins carry
// nothing else in gRPC 1.51.
absl::Status RetryLater(absl::StatusCode code, const std::string& message, std::chrono::milliseconds delay);

// As a client got the message, at most a minute. Empty: it says nothing, or no such refusal.
std::optional<std::chrono::milliseconds> RetryAfter(std::string_view message);

}  // namespace weft
