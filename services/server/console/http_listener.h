// HTTP/1.1 and WebSockets for browsers and programs by a few threads.
#pragma once

#include "services/server/console/awaitable.h"

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "services/ground/process/unique_fd.h"
#include "services/server/access/certificates.h"
#include "services/server/callers/door.h"
#include "services/server/console/http_exchange.h"

namespace weft {

struct HttpListenerOptions {
  std::string name = "console";         // in the log
  std::vector<std::string> host_names;  // as those of IsHostOfOurs, besides those of the certificate
  bool tokens_vouch = false;  // any Host will do with a token, which no foreign site's page can show
  TlsFiles tls;               // read again when they change
  bool uses_tls = false;
  DoorLimits door;
  std::chrono::seconds patience{15};  // with a body that does not end, and an answer that is not taken
  std::chrono::seconds idle{75};      // between requests of those that showed whose they are
  std::chrono::seconds stranger_patience{5};  // with others: handshake and first request, or the next one
  int threads = 2;
};

// Its connections stand in a Door. By Boost.Beast, since libmicrohttpd and cpp-httplib have no WebSockets,
// and the latter a thread per connection. Headers beyond 16 KiB and bodies beyond 1 MiB end the connection.
// Refused before the handler is asked: a Host that is none of ours, an Origin that is not the server's own,
// requests that a browser says come from another site, unless somebody follows a link. A proxy that ends TLS
// is heard (X-Forwarded-Host, X-Forwarded-Proto), since pages cannot send what it says. Every answer forbids
// sniffing, framing, and all content from elsewhere.
class HttpListener {
 public:
  using Handler = std::function<boost::asio::awaitable<void>(HttpExchange& exchange)>;
  // For answers that wait for nothing. Methods besides GET and HEAD are refused; a body ends the connection.
  static Handler Answering(std::function<HttpReply(HttpExchange& exchange)> answer);

  // `socket` listens already. InvalidArgument: certificate or key are none; errors of ReadWholeFile.
  static absl::StatusOr<std::unique_ptr<HttpListener>> Start(UniqueFd socket, HttpListenerOptions options,
                                                             Handler handler);
  // Handlers that wait are forgotten, in their places.
  ~HttpListener();
  // Nothing runs any more; what handlers hold lives until the destructor.
  void Stop();

 private:
  class Impl;
  explicit HttpListener(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace weft
