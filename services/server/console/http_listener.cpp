#include "services/server/console/http_listener.h"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/strand.hpp>
#include <boost/beast/ssl.hpp>
#include <map>
#include <thread>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "base/mutex.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/server/access/file_stamp.h"
#include "services/server/callers/network.h"
#include "services/server/console/http_connection.h"
#include "services/server/console/json_messages.h"

namespace weft {
namespace {

using asio::ip::tcp;
using PlainStream = beast::tcp_stream;
using TlsStream = beast::ssl_stream<beast::tcp_stream>;

absl::StatusOr<std::shared_ptr<asio::ssl::context>> ReadTls(const TlsFiles& files) {
  WEFT_ASSIGN_OR_RETURN(const std::string certificate, ReadWholeFile(files.certificate));
  WEFT_ASSIGN_OR_RETURN(const std::string key, ReadWholeFile(files.key));
  auto context = std::make_shared<asio::ssl::context>(asio::ssl::context::tls_server);
  boost::system::error_code error;
  context->set_options(asio::ssl::context::default_workarounds | asio::ssl::context::no_tlsv1 |
                       asio::ssl::context::no_tlsv1_1);
  // Of TLS 1.2 only ciphers that authenticate what they encrypt; all those of 1.3 do.
  if (SSL_CTX_set_min_proto_version(context->native_handle(), TLS1_2_VERSION) != 1 ||
      SSL_CTX_set_cipher_list(context->native_handle(), "ECDHE+AESGCM:ECDHE+CHACHA20") != 1)
    return absl::InternalError("OpenSSL lacks TLS 1.2 or its ciphers");
  context->use_certificate_chain(asio::buffer(certificate), error);
  if (!error) context->use_private_key(asio::buffer(key), asio::ssl::context::pem, error);
  if (!error) return context;
  return absl::InvalidArgumentError(absl::StrCat("no HTTPS server starts with ", files.certificate, " and ",
                                                 files.key, "; do they belong together?"));
}

HttpReply Refusal(int status, absl::StatusCode code, const std::string& message) {
  HttpReply reply;
  reply.status = status;
  reply.body = JsonOfStatus({code, message});
  reply.closes = true;
  return reply;
}

// Whether a page is one of ours. Before a server without TLS a proxy may end it, so that pages are https.
bool IsOwnOrigin(const std::string& origin, const std::string& host, bool uses_tls) {
  return absl::EqualsIgnoreCase(origin, "https://" + host) ||
         (!uses_tls && absl::EqualsIgnoreCase(origin, "http://" + host));
}

// Why a request is not for us; none: it is.
std::optional<HttpReply> CheckRequest(const HttpExchange& exchange, const HttpListenerOptions& options,
                                      const std::vector<std::string>& names) {
  // What the browser asked for, where a proxy asks by our address. Pages of other sites cannot send it.
  const std::string forwarded = exchange.Header("X-Forwarded-Host");
  const std::string host = forwarded.empty() ? exchange.Header("Host") : forwarded;
  const bool is_vouched_for = options.tokens_vouch && !BearerOf(exchange.Header("Authorization")).empty();
  if (!is_vouched_for && !IsHostOfOurs(host, names)) {
    return Refusal(
        421, absl::StatusCode::kPermissionDenied,
        absl::StrCat("Host: this is no name of this server; ask by its address, ",
                     options.tokens_vouch ? "show a token, " : "", "or give weftd --console-host"));
  }
  const std::string origin = exchange.Header("Origin");
  // Browsers send it with everything that changes something, and with WebSockets.
  const bool must_show = exchange.is_upgrade || (exchange.method != "GET" && exchange.method != "HEAD");
  if (origin.empty() ? must_show : !IsOwnOrigin(origin, host, options.uses_tls)) {
    return Refusal(403, absl::StatusCode::kPermissionDenied,
                   "Origin: only pages of this server are answered; a proxy must pass on Host or "
                   "X-Forwarded-Host as the browser sent it");
  }
  const std::string site = exchange.Header("Sec-Fetch-Site");
  const bool follows_link = exchange.Header("Sec-Fetch-Mode") == "navigate" && exchange.target.path == "/";
  if (site.empty() || site == "same-origin" || site == "none" || follows_link) return std::nullopt;
  return Refusal(403, absl::StatusCode::kPermissionDenied, "requests of other sites are refused");
}

}  // namespace

class HttpListener::Impl {
 public:
  Impl(HttpListenerOptions options, Handler handler)
      : options_(std::move(options)),
        handler_(std::move(handler)),
        door_(options_.door),
        acceptor_(asio::make_strand(io_)) {}
  ~Impl() { Stop(); }

  absl::Status Begin(UniqueFd socket) {
    if (options_.uses_tls) {
      const MutexLock lock(mutex_);
      tls_stamp_ = TlsStamp();
      WEFT_ASSIGN_OR_RETURN(auto tls, ReadTls(options_.tls));
      tls_ = std::move(tls);
      tls_names_ = NamesOfCertificate(options_.tls.certificate);
    }
    const tcp::endpoint endpoint = [&] {
      sockaddr_storage name{};
      socklen_t size = sizeof name;
      getsockname(socket.get(), reinterpret_cast<sockaddr*>(&name), &size);
      return name.ss_family == AF_INET6 ? tcp::endpoint(tcp::v6(), 0) : tcp::endpoint(tcp::v4(), 0);
    }();
    acceptor_.assign(endpoint.protocol(), socket.Release());
    asio::co_spawn(acceptor_.get_executor(), Accept(), asio::detached);
    for (int i = 0; i < options_.threads; ++i) threads_.emplace_back([this] { io_.run(); });
    return absl::OkStatus();
  }

  void Stop() {
    io_.stop();
    for (std::thread& thread : threads_) thread.join();
    threads_.clear();
  }

 private:
  std::string TlsStamp() const {
    return absl::StrCat(FileStamp(options_.tls.certificate), " ", FileStamp(options_.tls.key));
  }

  std::vector<std::string> HostNames() {
    std::vector<std::string> names = options_.host_names;
    const MutexLock lock(mutex_);
    names.insert(names.end(), tls_names_.begin(), tls_names_.end());
    return names;
  }

  // Of new connections; a certificate that cannot be read leaves the old one.
  std::shared_ptr<asio::ssl::context> CurrentTls() {
    constexpr std::chrono::seconds kLookEvery{5};
    const MutexLock lock(mutex_);
    const auto now = std::chrono::steady_clock::now();
    if (now - looked_ < kLookEvery) return tls_;
    looked_ = now;
    std::string stamp = TlsStamp();
    if (stamp == tls_stamp_) return tls_;
    tls_stamp_ = std::move(stamp);
    auto tls = ReadTls(options_.tls);
    if (tls.ok()) {
      tls_ = *std::move(tls);
      tls_names_ = NamesOfCertificate(options_.tls.certificate);
    }
    if (!tls.ok())
      spdlog::warn("{} keeps its old certificate: {}", options_.name, std::string(tls.status().message()));
    return tls_;
  }

  // A connection with its place in the door.
  struct Guest {
    uint64_t place = 0;
    std::string peer;
    std::chrono::steady_clock::time_point came;
    bool is_known = false;
    bool timed_out = false;
  };

  // None: it is refused.
  std::optional<Guest> Enter(tcp::socket& socket, const std::string& peer) {
    const auto now = std::chrono::steady_clock::now();
    const MutexLock lock(mutex_);
    const std::optional<Door::Entry> entry = door_.Enter(peer, now);
    if (!entry) {
      WarnOfRefusal(peer, now);
      return std::nullopt;
    }
    if (entry->displaced) {
      const auto displaced = sockets_.find(*entry->displaced);
      if (displaced != sockets_.end()) shutdown(displaced->second.get(), SHUT_RDWR);
    }
    // A descriptor of its own, so that no other file has its number by then.
    sockets_[entry->place] = UniqueFd(fcntl(socket.native_handle(), F_DUPFD_CLOEXEC, 0));
    return Guest{entry->place, peer, now};
  }
  void Recognize(Guest& guest, const std::string& account) {
    const MutexLock lock(mutex_);
    guest.is_known = door_.Recognize(guest.place, account, std::chrono::steady_clock::now());
    if (guest.is_known) sockets_.erase(guest.place);
  }
  void Leave(const Guest& guest) {
    const MutexLock lock(mutex_);
    sockets_.erase(guest.place);
    door_.Leave(guest.place, guest.timed_out, std::chrono::steady_clock::now());
  }
  void WarnOfRefusal(const std::string& peer, std::chrono::steady_clock::time_point now)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    constexpr std::chrono::seconds kQuiet{10};
    if (now - warned_ < kQuiet) return;
    warned_ = now;
    spdlog::warn("{}: connections of {} are refused: it makes too many, or leaves requests unfinished",
                 options_.name, peer);
  }

  asio::awaitable<void> Accept() {
    while (true) {
      beast::error_code error;
      tcp::socket socket(asio::make_strand(io_));
      co_await acceptor_.async_accept(socket, asio::redirect_error(asio::use_awaitable, error));
      if (error) {
        // Without descriptors, for instance: others end meanwhile.
        asio::steady_timer pause(acceptor_.get_executor(), std::chrono::milliseconds(50));
        co_await pause.async_wait(asio::redirect_error(asio::use_awaitable, error));
        continue;
      }
      const tcp::endpoint remote = socket.remote_endpoint(error);
      if (error) continue;
      std::optional<Guest> guest = Enter(socket, NetworkOf(remote.address().to_string()));
      if (!guest) continue;
      socket.set_option(tcp::no_delay(true), error);
      const auto executor = socket.get_executor();
      asio::co_spawn(executor, Serve(std::move(socket), *std::move(guest)), asio::detached);
    }
  }

  asio::awaitable<void> Serve(tcp::socket socket, Guest guest) {
    try {
      if (options_.uses_tls) {
        const std::shared_ptr<asio::ssl::context> tls = CurrentTls();
        TlsStream stream(PlainStream(std::move(socket)), *tls);
        beast::error_code error;
        beast::get_lowest_layer(stream).expires_at(guest.came + options_.stranger_patience);
        co_await stream.async_handshake(asio::ssl::stream_base::server,
                                        asio::redirect_error(asio::use_awaitable, error));
        if (!error) co_await Requests(stream, guest);
      } else {
        PlainStream stream(std::move(socket));
        co_await Requests(stream, guest);
      }
    } catch (const std::exception& failure) {
      spdlog::warn("{}: {}", options_.name, failure.what());
    }
    Leave(guest);
  }

  template <typename Stream>
  asio::awaitable<void> Requests(Stream& stream, Guest& guest) {
    beast::flat_buffer buffer;
    for (bool is_first = true;; is_first = false) {
      typename ExchangeOf<Stream>::Parser parser;
      parser.header_limit(kLargestHeader_bytes);
      parser.body_limit(kLargestBody_bytes);
      beast::error_code error;
      if (is_first) {
        beast::get_lowest_layer(stream).expires_at(guest.came + options_.stranger_patience);
      } else {
        beast::get_lowest_layer(stream).expires_after(guest.is_known ? options_.idle
                                                                     : options_.stranger_patience);
      }
      co_await http::async_read_header(stream, buffer, parser,
                                       asio::redirect_error(asio::use_awaitable, error));
      // Browsers open connections ahead of their requests, and say nothing on them.
      guest.timed_out = error == beast::error::timeout && buffer.size() > 0;
      if (error) co_return;
      ExchangeOf<Stream> exchange(stream, buffer, parser, options_.patience);
      exchange.recognize = [this, &guest](const std::string& account) { Recognize(guest, account); };
      co_await Answer(parser, exchange, guest.peer);
      if (exchange.upgraded()) co_return;
      if (!exchange.keeps()) {
        // Sends what TCP still has; a browser that waits for more gets the end.
        beast::get_lowest_layer(stream).socket().shutdown(tcp::socket::shutdown_send, error);
        co_return;
      }
    }
  }

  template <typename Stream>
  asio::awaitable<void> Answer(typename ExchangeOf<Stream>::Parser& parser, ExchangeOf<Stream>& exchange,
                               const std::string& peer) {
    const auto& request = parser.get();
    exchange.method = std::string(request.method_string());
    exchange.peer = peer;
    exchange.uses_tls =
        options_.uses_tls || absl::EqualsIgnoreCase(exchange.Header("X-Forwarded-Proto"), "https");
    exchange.is_upgrade = beast::websocket::is_upgrade(request);
    exchange.has_body = !parser.is_done();
    absl::StatusOr<RequestTarget> target = ParseTarget({request.target().data(), request.target().size()});
    if (!target.ok()) {
      co_await exchange.Send(Refusal(400, target.status().code(), std::string(target.status().message())));
      co_return;
    }
    exchange.target = *std::move(target);
    if (std::optional<HttpReply> refusal = CheckRequest(exchange, options_, HostNames())) {
      co_await exchange.Send(*std::move(refusal));
      co_return;
    }
    co_await handler_(exchange);
    if (!exchange.answered()) exchange.Break();
  }

  const HttpListenerOptions options_;
  const Handler handler_;
  Mutex mutex_;
  std::shared_ptr<asio::ssl::context> tls_ ABSL_GUARDED_BY(mutex_);
  std::string tls_stamp_ ABSL_GUARDED_BY(mutex_);
  std::vector<std::string> tls_names_ ABSL_GUARDED_BY(mutex_);
  std::chrono::steady_clock::time_point looked_ ABSL_GUARDED_BY(mutex_);
  Door door_ ABSL_GUARDED_BY(mutex_);
  std::map<uint64_t, UniqueFd> sockets_ ABSL_GUARDED_BY(mutex_);  // of strangers, by their places
  std::chrono::steady_clock::time_point warned_ ABSL_GUARDED_BY(mutex_);
  asio::io_context io_;
  tcp::acceptor acceptor_;
  std::vector<std::thread> threads_;
};

absl::StatusOr<std::unique_ptr<HttpListener>> HttpListener::Start(UniqueFd socket,
                                                                  HttpListenerOptions options,
                                                                  Handler handler) {
  auto impl = std::make_unique<Impl>(std::move(options), std::move(handler));
  WEFT_RETURN_IF_ERROR(impl->Begin(std::move(socket)));
  return std::unique_ptr<HttpListener>(new HttpListener(std::move(impl)));
}

HttpListener::Handler HttpListener::Answering(std::function<HttpReply(HttpExchange& exchange)> answer) {
  return [answer = std::move(answer)](HttpExchange& exchange) -> asio::awaitable<void> {
    if (exchange.has_body) co_return;
    const bool reads = exchange.method == "GET" || exchange.method == "HEAD";
    HttpReply reply =
        reads ? answer(exchange) : HttpReply{405, "text/plain; charset=utf-8", "GET and HEAD are answered\n"};
    co_await exchange.Send(std::move(reply));
  };
}

HttpListener::HttpListener(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
HttpListener::~HttpListener() = default;
void HttpListener::Stop() { impl_->Stop(); }

}  // namespace weft
