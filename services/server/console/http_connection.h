// One connection of a browser, for http_listener.cpp alone.
#pragma once

#include "services/server/console/awaitable.h"

#include <boost/asio/redirect_error.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "services/server/console/http_exchange.h"

namespace weft {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;

constexpr uint32_t kLargestHeader_bytes = 16 << 10;
constexpr uint64_t kLargestBody_bytes = 1 << 20;
constexpr uint64_t kLargestOrder_bytes = 256 << 10;
constexpr std::chrono::seconds kSocketIdle{30};  // then it is pinged, and ended when nothing comes back

// Content from elsewhere, and framing, are for nobody; WebAssembly decodes meshes.
constexpr char kContentPolicy[] =
    "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' data: blob:; "
    "connect-src 'self'; worker-src 'self'; frame-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'self'";

template <typename Stream>
class SocketOf final : public PageSocket {
 public:
  explicit SocketOf(Stream stream) : socket_(std::move(stream)) {}

  asio::awaitable<bool> Accept(const http::request<http::string_body>& request) {
    beast::get_lowest_layer(socket_).expires_never();  // it has time-outs of its own
    auto timeouts = beast::websocket::stream_base::timeout::suggested(beast::role_type::server);
    timeouts.idle_timeout = kSocketIdle;
    timeouts.keep_alive_pings = true;
    socket_.set_option(timeouts);
    socket_.read_message_max(kLargestOrder_bytes);
    beast::error_code error;
    co_await socket_.async_accept(request, asio::redirect_error(asio::use_awaitable, error));
    co_return !error;
  }
  asio::awaitable<std::optional<std::string>> Read() override {
    beast::flat_buffer buffer;
    beast::error_code error;
    co_await socket_.async_read(buffer, asio::redirect_error(asio::use_awaitable, error));
    if (error || !socket_.got_text()) co_return std::nullopt;
    co_return beast::buffers_to_string(buffer.data());
  }
  asio::awaitable<bool> Write(std::string text) override {
    beast::error_code error;
    socket_.text(true);
    co_await socket_.async_write(asio::buffer(text), asio::redirect_error(asio::use_awaitable, error));
    co_return !error;
  }
  asio::awaitable<void> Close() override {
    beast::error_code error;
    co_await socket_.async_close(beast::websocket::close_code::normal,
                                 asio::redirect_error(asio::use_awaitable, error));
  }

 private:
  beast::websocket::stream<Stream> socket_;
};

template <typename Stream>
class ExchangeOf final : public HttpExchange {
 public:
  using Parser = http::request_parser<http::string_body>;

  ExchangeOf(Stream& stream, beast::flat_buffer& buffer, Parser& parser, std::chrono::seconds patience)
      : stream_(stream), buffer_(buffer), parser_(parser), patience_(patience) {
    keeps_ = parser_.get().keep_alive();
  }

  bool keeps() const { return keeps_ && parser_.is_done(); }
  bool upgraded() const { return upgraded_; }  // the stream is somebody else's
  bool answered() const { return answered_; }

  std::string Header(std::string_view name) const override {
    const auto value = parser_.get()[beast::string_view(name.data(), name.size())];
    return {value.data(), value.size()};
  }

  asio::awaitable<std::optional<std::string>> ReadBody() override {
    beast::error_code error;
    beast::get_lowest_layer(stream_).expires_after(patience_);
    co_await http::async_read(stream_, buffer_, parser_, asio::redirect_error(asio::use_awaitable, error));
    if (error) co_return std::nullopt;
    co_return std::move(parser_.get().body());
  }

  asio::awaitable<bool> Send(HttpReply reply) override {
    const std::string body = std::exchange(reply.body, "");
    if (!co_await SendHead(std::move(reply), static_cast<int64_t>(body.size()))) co_return false;
    co_return co_await SendPart(body);
  }

  asio::awaitable<bool> SendHead(HttpReply reply, int64_t bytes) override {
    answered_ = true;
    // What was not read of a request stands in the way of the next one.
    if (reply.closes || !parser_.is_done()) keeps_ = false;
    http::response<http::empty_body> head(static_cast<http::status>(reply.status), 11);
    head.set(http::field::content_type, reply.type);
    head.set("X-Content-Type-Options", "nosniff");
    head.set("Content-Security-Policy", kContentPolicy);
    head.set("Cross-Origin-Resource-Policy", "same-origin");
    head.set("Cross-Origin-Opener-Policy", "same-origin");
    head.set("Referrer-Policy", "no-referrer");
    head.set(http::field::cache_control, "no-store");
    for (const auto& [name, value] : reply.headers) head.set(name, value);
    head.content_length(static_cast<uint64_t>(bytes));
    head.keep_alive(keeps_);
    http::response_serializer<http::empty_body> serializer(head);
    beast::error_code error;
    beast::get_lowest_layer(stream_).expires_after(patience_);
    co_await http::async_write_header(stream_, serializer, asio::redirect_error(asio::use_awaitable, error));
    if (error) keeps_ = false;
    co_return !error;
  }

  asio::awaitable<bool> SendPart(std::string_view part) override {
    if (part.empty() || method == "HEAD") co_return true;
    beast::error_code error;
    // Slow networks get a part in pieces, each with patience of its own.
    constexpr size_t kPiece_bytes = 64 << 10;
    while (!part.empty() && !error) {
      const std::string_view piece = part.substr(0, kPiece_bytes);
      beast::get_lowest_layer(stream_).expires_after(patience_);
      co_await asio::async_write(stream_, asio::buffer(piece.data(), piece.size()),
                                 asio::redirect_error(asio::use_awaitable, error));
      part.remove_prefix(piece.size());
    }
    if (error) keeps_ = false;
    co_return !error;
  }

  void Break() override { keeps_ = false; }

  asio::awaitable<std::unique_ptr<PageSocket>> Upgrade() override {
    answered_ = true;
    keeps_ = false;
    upgraded_ = true;
    const http::request<http::string_body> request = parser_.release();
    auto socket = std::make_unique<SocketOf<Stream>>(std::move(stream_));
    if (!co_await socket->Accept(request)) co_return nullptr;
    co_return socket;
  }

 private:
  Stream& stream_;
  beast::flat_buffer& buffer_;
  Parser& parser_;
  const std::chrono::seconds patience_;
  bool keeps_ = false, answered_ = false, upgraded_ = false;
};

}  // namespace weft
