// The one socket of a page, over which all that it watches comes.
#pragma once

#include "services/server/console/awaitable.h"

#include <chrono>
#include <memory>
#include <string>

#include "services/server/console/browser_sessions.h"
#include "services/server/console/daemon_calls.h"
#include "services/server/console/http_exchange.h"

namespace weft {

// A page sends "ID METHOD\n" and a request as JSON, and gets "ID message\n" and a message as JSON for each of
// the answer, then "ID end\n" and a ConsoleError. "ID cancel" ends it before. Browsers open six connections
// to a server, so streams of their own (server-sent events) would stand still in the third tab.
// Back-pressure: the daemon's next message is asked for when the page has taken the last one. "0 alive\n" and
// the daemon's clock in ns come every 5 s; the socket ends when the browser's session does. Returns when the
// page is gone.
struct LiveSocketOptions {
  std::chrono::milliseconds beat{5000};
  size_t streams = 64;  // at once
};
boost::asio::awaitable<void> ServeSocket(std::unique_ptr<PageSocket> socket, std::string session_id,
                                         CallFor caller, BrowserSessions& sessions, DaemonCalls& calls,
                                         LiveSocketOptions options = {});

}  // namespace weft
