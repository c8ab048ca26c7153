// Files of the daemon for browsers.
#pragma once

#include "services/server/console/awaitable.h"

#include <string>

#include "services/server/console/daemon_calls.h"
#include "services/server/console/http_exchange.h"

namespace weft {

// The file that a method which sends FileChunks answers to the request in the query: its fields by name, and
// `save_as` for a name to save it under. A Range is sent
// alone where If-Range names the ETag of the beginning; a file that was written anew meanwhile is ABORTED.
// Pages and drawings are shown in a sandbox, since reports have scripts of their own; what browsers need not
// show is saved.
boost::asio::awaitable<void> SendFile(HttpExchange& exchange, std::string method, CallFor caller,
                                      DaemonCalls& calls);

}  // namespace weft
