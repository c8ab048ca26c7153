// A request of a browser and its answer, over a plain connection or TLS.
#pragma once

#include "services/server/console/awaitable.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "services/server/console/request_target.h"

namespace weft {

struct HttpReply {
  int status = 200;
  std::string type = "application/json";
  std::string body;
  std::vector<std::pair<std::string, std::string>> headers;  // further ones
  bool closes = false;                                       // the connection, afterwards
};

// A WebSocket (RFC 6455). One reader, one writer.
class PageSocket {
 public:
  virtual ~PageSocket() = default;
  // None: the page is gone.
  virtual boost::asio::awaitable<std::optional<std::string>> Read() = 0;
  // False: the page is gone.
  virtual boost::asio::awaitable<bool> Write(std::string text) = 0;
  virtual boost::asio::awaitable<void> Close() = 0;
};

class HttpExchange {
 public:
  virtual ~HttpExchange() = default;

  std::string method;  // "GET"
  RequestTarget target;
  std::string peer;         // "10.0.0.5", or a network (network.h)
  bool uses_tls = false;    // between the browser and this server, or a proxy before it
  bool is_upgrade = false;  // asks for a WebSocket
  bool has_body = false;    // that was not read yet

  // The connection showed whose it is, which keeps it from making room for others.
  std::function<void(const std::string& account)> recognize = [](const std::string&) {};

  // Empty: there is none.
  virtual std::string Header(std::string_view name) const = 0;
  // None: it is too long or broke off, and nothing can be answered.
  virtual boost::asio::awaitable<std::optional<std::string>> ReadBody() = 0;
  virtual boost::asio::awaitable<bool> Send(HttpReply reply) = 0;
  // A body of `bytes` in parts; `reply` has none.
  virtual boost::asio::awaitable<bool> SendHead(HttpReply reply, int64_t bytes) = 0;
  virtual boost::asio::awaitable<bool> SendPart(std::string_view part) = 0;
  // The connection ends, since the answer cannot be completed.
  virtual void Break() = 0;
  // Null: the handshake failed. Ends the exchange.
  virtual boost::asio::awaitable<std::unique_ptr<PageSocket>> Upgrade() = 0;
};

}  // namespace weft
