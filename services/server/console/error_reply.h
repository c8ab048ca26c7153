// Errors of the API as browsers get them.
#pragma once

#include "absl/status/status.h"
#include "services/server/console/http_exchange.h"

namespace weft {

// A ConsoleError with the status of HTTP that fits.
HttpReply ErrorReply(const absl::Status& status);

}  // namespace weft
