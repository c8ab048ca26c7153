#include "services/server/http/http_server.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <microhttpd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <exception>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "base/status_macros.h"
#include "services/server/callers/network.h"

namespace weft {
namespace {

// TLS 1.2 and 1.3 with forward secrecy and ciphers that authenticate what they encrypt.
constexpr char kTlsPriorities[] =
    "NONE:+VERS-TLS1.3:+VERS-TLS1.2:+AES-256-GCM:+AES-128-GCM:+CHACHA20-POLY1305:+AEAD:+ECDHE-ECDSA:"
    "+ECDHE-RSA:+GROUP-X25519:+GROUP-SECP256R1:+GROUP-SECP384R1:+GROUP-SECP521R1:+SIGN-ALL:+CTYPE-X509:"
    "+COMP-NULL:%SERVER_PRECEDENCE";
constexpr size_t kConnectionMemory_bytes = 32 << 10;  // requests and their headers

bool IsAddress(const std::string& text) {
  in6_addr ignored = {};
  return inet_pton(AF_INET, text.c_str(), &ignored) == 1 || inet_pton(AF_INET6, text.c_str(), &ignored) == 1;
}

// The host of HOST or HOST:PORT, without brackets.
std::string WithoutPort(const std::string& host) {
  if (absl::StartsWith(host, "[")) {
    const size_t end = host.find(']');
    const bool has_end = end != std::string::npos && (end + 1 == host.size() || host[end + 1] == ':');
    return has_end ? host.substr(1, end - 1) : "";
  }
  return host.substr(0, host.find(':'));
}

std::string HeaderOf(MHD_Connection* connection, const char* name) {
  const char* value = MHD_lookup_connection_value(connection, MHD_HEADER_KIND, name);
  return value == nullptr ? "" : value;
}

std::string BearerOf(const std::string& authorization) {
  constexpr absl::string_view kScheme = "bearer ";
  return absl::StartsWithIgnoreCase(authorization, kScheme) ? authorization.substr(kScheme.size()) : "";
}

std::string PeerOf(MHD_Connection* connection) {
  const MHD_ConnectionInfo* info = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CLIENT_ADDRESS);
  if (info == nullptr || info->client_addr == nullptr) return "";
  char text[INET6_ADDRSTRLEN] = "";
  const sockaddr& address = *info->client_addr;
  const void* bytes =
      address.sa_family == AF_INET6
          ? static_cast<const void*>(&reinterpret_cast<const sockaddr_in6&>(address).sin6_addr)
          : &reinterpret_cast<const sockaddr_in&>(address).sin_addr;
  const char* named = inet_ntop(address.sa_family, bytes, text, sizeof text);
  return named == nullptr ? "" : NetworkOf(named);
}

void* GuestOf(MHD_Connection* connection) {
  const MHD_ConnectionInfo* info = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_SOCKET_CONTEXT);
  return info == nullptr ? nullptr : info->socket_context;
}

// Why a request is not for us; 200: it is.
HttpAnswer CheckRequest(MHD_Connection* connection, const std::string& method,
                        const HttpServerOptions& options) {
  if (method != MHD_HTTP_METHOD_GET && method != MHD_HTTP_METHOD_HEAD)
    return {MHD_HTTP_METHOD_NOT_ALLOWED, "text/plain; charset=utf-8", "GET and HEAD are answered\n"};
  const std::string host = HeaderOf(connection, MHD_HTTP_HEADER_HOST);
  const bool shows_token = !BearerOf(HeaderOf(connection, MHD_HTTP_HEADER_AUTHORIZATION)).empty();
  if (!shows_token && !IsHostOfOurs(host, options.host_names)) {
    return {MHD_HTTP_MISDIRECTED_REQUEST, "text/plain; charset=utf-8",
            "Host: this is no name of this server; ask by its address, show a token, or give weftd "
            "--console-host\n"};
  }
  const std::string origin = HeaderOf(connection, MHD_HTTP_HEADER_ORIGIN);
  const std::string own = absl::StrCat(options.key_pem.empty() ? "http://" : "https://", host);
  if (!origin.empty() && !absl::EqualsIgnoreCase(origin, own)) {
    return {MHD_HTTP_FORBIDDEN, "text/plain; charset=utf-8",
            "Origin: pages of other servers get nothing here\n"};
  }
  return {};
}

MHD_Result Send(MHD_Connection* connection, const HttpAnswer& answer) {
  MHD_Response* response = MHD_create_response_from_buffer(
      answer.body.size(), const_cast<char*>(answer.body.data()), MHD_RESPMEM_MUST_COPY);
  if (response == nullptr) return MHD_NO;
  const std::pair<const char*, const char*> headers[] = {{"Content-Type", answer.type.c_str()},
                                                         {"X-Content-Type-Options", "nosniff"},
                                                         {"Cache-Control", "no-store"}};
  for (const auto& [name, value] : headers) MHD_add_response_header(response, name, value);
  if (answer.status == MHD_HTTP_UNAUTHORIZED)
    MHD_add_response_header(response, MHD_HTTP_HEADER_WWW_AUTHENTICATE, "Bearer");
  const MHD_Result queued =
      MHD_queue_response(connection, static_cast<unsigned int>(answer.status), response);
  MHD_destroy_response(response);
  return queued;
}

}  // namespace

bool IsHostOfOurs(const std::string& host, const std::vector<std::string>& names) {
  const std::string name = absl::AsciiStrToLower(WithoutPort(host));
  const size_t dot = std::min(name.find('.'), name.size());
  const std::string any_step = dot == 0 || dot == name.size() ? name : "*" + name.substr(dot);
  return name == "localhost" || IsAddress(name) ||
         std::any_of(names.begin(), names.end(), [&](const std::string& ours) {
           const std::string lower = absl::AsciiStrToLower(ours);
           return lower == name || lower == any_step;
         });
}

struct HttpServer::Running {
  MHD_Daemon* daemon = nullptr;
  HttpServer* server = nullptr;
  HttpServerOptions options;

  ~Running() {
    if (daemon == nullptr) return;
    close(MHD_quiesce_daemon(daemon));  // otherwise the end may shut the socket down, which others share
    MHD_stop_daemon(daemon);
  }

  static void Notify(void* self, MHD_Connection* connection, void** guest,
                     MHD_ConnectionNotificationCode code) {
    auto& running = *static_cast<Running*>(self);
    if (code == MHD_CONNECTION_NOTIFY_CLOSED) {
      running.server->Leave(guest);
      return;
    }
    const MHD_ConnectionInfo* info = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD);
    if (info != nullptr) running.server->Enter(guest, info->connect_fd, PeerOf(connection));
  }

  // MHD calls once with the headers, and once more with the end of the body.
  static MHD_Result Handle(void* self, MHD_Connection* connection, const char* url, const char* method,
                           const char* /*version*/, const char* /*body*/, size_t* body_bytes, void** state) {
    const auto& running = *static_cast<Running*>(self);
    static int seen;
    if (*state == nullptr) {
      *state = &seen;
      const HttpAnswer refusal = CheckRequest(connection, method, running.options);
      return refusal.status == 200 ? MHD_YES : Send(connection, refusal);
    }
    if (*body_bytes > 0) return MHD_NO;  // ends the connection
    const HttpRequest request{url, BearerOf(HeaderOf(connection, MHD_HTTP_HEADER_AUTHORIZATION)),
                              PeerOf(connection)};
    try {
      const HttpAnswer answer = running.server->answer_(request);
      if (answer.status == MHD_HTTP_OK && !request.token.empty())
        running.server->Recognize(GuestOf(connection), request.token);
      return Send(connection, answer);
    } catch (const std::exception&) {
      return Send(connection, {MHD_HTTP_INTERNAL_SERVER_ERROR, "text/plain; charset=utf-8", "failed\n"});
    }
  }
};

HttpServer::HttpServer(UniqueFd socket, HttpServerOptions options, Answer answer)
    : socket_(std::move(socket)),
      options_(std::move(options)),
      door_({.all = options_.connections,
             .kept = options_.connections / 2,
             .of_one_peer = options_.connections_of_one_address}),
      answer_(std::move(answer)) {}

void HttpServer::Enter(void** guest, int socket, const std::string& peer) {
  const Door::Time now = std::chrono::steady_clock::now();
  const MutexLock lock(mutex_);
  // MHD ends what is silent, and not what sends a byte from time to time.
  for (const auto& [place, stranger] : strangers_) {
    if (now - stranger.came > options_.patience) shutdown(stranger.socket, SHUT_RDWR);
  }
  const std::optional<Door::Entry> entry = door_.Enter(peer, now);
  if (!entry) {
    shutdown(socket, SHUT_RDWR);
    return;
  }
  if (entry->displaced) {
    const auto displaced = strangers_.find(*entry->displaced);
    if (displaced != strangers_.end()) shutdown(displaced->second.socket, SHUT_RDWR);
  }
  strangers_[entry->place] = {socket, now};
  *guest = new uint64_t(entry->place);
}

void HttpServer::Recognize(void* guest, const std::string& token) {
  if (guest == nullptr) return;
  const MutexLock lock(mutex_);
  const uint64_t place = *static_cast<uint64_t*>(guest);
  if (door_.Recognize(place, token, std::chrono::steady_clock::now())) strangers_.erase(place);
}

void HttpServer::Leave(void** guest) {
  const std::unique_ptr<uint64_t> place(static_cast<uint64_t*>(*guest));
  *guest = nullptr;
  if (!place) return;
  const MutexLock lock(mutex_);
  strangers_.erase(*place);
  door_.Leave(*place, false, std::chrono::steady_clock::now());
}

HttpServer::~HttpServer() = default;

absl::StatusOr<std::unique_ptr<HttpServer>> HttpServer::Start(UniqueFd socket, HttpServerOptions options,
                                                              Answer answer) {
  std::unique_ptr<HttpServer> server(
      new HttpServer(std::move(socket), std::move(options), std::move(answer)));
  WEFT_ASSIGN_OR_RETURN(std::unique_ptr<Running> running, server->Run(server->options_));
  server->running_ = std::move(running);
  return server;
}

absl::StatusOr<std::unique_ptr<HttpServer::Running>> HttpServer::Run(const HttpServerOptions& options) {
  auto running = std::make_unique<Running>();
  running->server = this;
  running->options = options;
  const bool tls = !options.key_pem.empty();
  const int listening = fcntl(socket_.get(), F_DUPFD_CLOEXEC, 0);
  std::vector<MHD_OptionItem> settings = {
      // The door counts; those that it displaced are still there for a moment.
      {MHD_OPTION_CONNECTION_LIMIT, 2 * options.connections, nullptr},
      {MHD_OPTION_NOTIFY_CONNECTION, reinterpret_cast<intptr_t>(&Running::Notify), running.get()},
      {MHD_OPTION_CONNECTION_TIMEOUT, options.patience.count(), nullptr},
      {MHD_OPTION_CONNECTION_MEMORY_LIMIT, static_cast<intptr_t>(kConnectionMemory_bytes), nullptr},
      // The next server on the socket goes on with it.
      {MHD_OPTION_LISTEN_SOCKET, listening, nullptr}};
  if (tls) {
    settings.push_back(
        {MHD_OPTION_HTTPS_MEM_CERT, 0, const_cast<char*>(running->options.certificate_pem.c_str())});
    settings.push_back({MHD_OPTION_HTTPS_MEM_KEY, 0, const_cast<char*>(running->options.key_pem.c_str())});
    settings.push_back({MHD_OPTION_HTTPS_PRIORITIES, 0, const_cast<char*>(kTlsPriorities)});
  }
  settings.push_back({MHD_OPTION_END, 0, nullptr});
  const unsigned int flags =
      MHD_USE_AUTO | MHD_USE_INTERNAL_POLLING_THREAD | (tls ? unsigned{MHD_USE_TLS} : 0U);
  running->daemon = MHD_start_daemon(flags, 0, nullptr, nullptr, &Running::Handle, running.get(),
                                     MHD_OPTION_ARRAY, settings.data(), MHD_OPTION_END);
  if (running->daemon != nullptr) return running;
  close(listening);
  return absl::InvalidArgumentError(
      tls ? "no HTTPS server starts with this certificate and key; do they belong together?"
          : "no HTTP server starts");
}

absl::Status HttpServer::ChangeCertificate(const std::string& certificate_pem, const std::string& key_pem) {
  HttpServerOptions changed = options_;
  changed.certificate_pem = certificate_pem;
  changed.key_pem = key_pem;
  WEFT_ASSIGN_OR_RETURN(std::unique_ptr<Running> running, Run(changed));
  running_ = std::move(running);
  options_ = std::move(changed);
  return absl::OkStatus();
}

}  // namespace weft
