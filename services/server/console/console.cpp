#include "services/server/console/console.h"

#include <spdlog/spdlog.h>

#include <map>
#include <optional>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "capture/file/plain_text.h"
#include "services/server/console/browser_sessions.h"
#include "services/server/console/daemon_calls.h"
#include "services/server/console/error_reply.h"
#include "services/server/console/file_download.h"
#include "services/server/console/http_listener.h"
#include "services/server/console/json_messages.h"
#include "services/server/console/live_socket.h"
#include "services/server/console/mesh_download.h"
#include "services/server/console/page_files.h"
#include "services/server/rpc/service_files.h"
#include "weft/v1/console.pb.h"

namespace weft {
namespace {

namespace asio = boost::asio;

constexpr std::chrono::minutes kCallPatience{5};  // with a call: inputs of a job are read meanwhile
constexpr char kApi[] = "/api/", kFile[] = "/file/", kMesh[] = "/mesh/";

}  // namespace

class Console::Impl {
 public:
  Impl(ConsoleOptions options, const Sources& sources)
      : options_(std::move(options)),
        audit_(sources.audit),
        sessions_(options_.session_file, sources.access),
        calls_(std::make_unique<DaemonCalls>(sources.connect)) {}
  ~Impl() {
    if (listener_) listener_->Stop();
    calls_.reset();  // gRPC's last words still go to the listener's queues
    meshes_.Stop();  // and so do those of the encoder
    listener_.reset();
  }

  absl::Status Begin(UniqueFd socket) {
    if (!options_.page_folder.empty()) {
      WEFT_ASSIGN_OR_RETURN(pages_, LoadPageFiles(options_.page_folder));
    }
    HttpListenerOptions http;
    http.host_names = options_.host_names;
    http.tls = options_.tls;
    http.uses_tls = options_.uses_tls;
    WEFT_ASSIGN_OR_RETURN(listener_,
                          HttpListener::Start(std::move(socket), std::move(http),
                                              [this](HttpExchange& exchange) { return Answer(exchange); }));
    return absl::OkStatus();
  }

 private:
  asio::awaitable<void> Answer(HttpExchange& exchange) {
    const std::string& path = exchange.target.path;
    const bool reads = exchange.method == "GET" || exchange.method == "HEAD";
    const bool posts = exchange.method == "POST";
    const absl::StatusOr<BrowserSession> session = sessions_.Find(CookieOf(exchange));
    if (session.ok()) exchange.recognize(session->caller.name);
    if (reads && !exchange.is_upgrade && (path == "/" || pages_.contains(path))) {
      co_await exchange.Send(Page(exchange));
    } else if (posts && path == "/login") {
      co_await LogIn(exchange);
    } else if (!reads && !posts) {
      HttpReply reply = ErrorReply(absl::UnimplementedError("GET, HEAD and POST are answered"));
      reply.status = 405;
      co_await exchange.Send(std::move(reply));
    } else if (session.ok()) {
      co_await AnswerUser(exchange, *session);
    } else {
      co_await exchange.Send(ErrorReply(session.status()));
    }
  }

  asio::awaitable<void> AnswerUser(HttpExchange& exchange, const BrowserSession& session) {
    const std::string path = exchange.target.path;
    const bool posts = exchange.method == "POST";
    const CallFor caller{session.id_sha256, exchange.peer, session.token_sha256};
    if (exchange.is_upgrade && path == "/live" && !posts) {
      const std::string id = CookieOf(exchange);
      std::unique_ptr<PageSocket> socket = co_await exchange.Upgrade();
      if (socket) co_await ServeSocket(std::move(socket), id, caller, sessions_, *calls_);
    } else if (!posts && path == "/session") {
      co_await exchange.Send(UserReply(session));
    } else if (posts && path == "/logout") {
      sessions_.End(CookieOf(exchange));
      HttpReply reply{.body = "{}"};
      reply.headers.emplace_back("Set-Cookie", CookieText(exchange, "", 0));
      co_await exchange.Send(std::move(reply));
    } else if (posts && absl::StartsWith(path, kApi)) {
      co_await CallMethod(exchange, path.substr(sizeof kApi - 1), caller);
    } else if (!posts && absl::StartsWith(path, kFile)) {
      co_await SendFile(exchange, path.substr(sizeof kFile - 1), caller, *calls_);
    } else if (!posts && absl::StartsWith(path, kMesh)) {
      co_await meshes_.Send(exchange, path.substr(sizeof kMesh - 1), caller, *calls_);
    } else {
      co_await exchange.Send(ErrorReply(absl::NotFoundError("there is nothing here; the console is at /")));
    }
  }

  HttpReply Page(const HttpExchange& exchange) const {
    const auto found = pages_.find(exchange.target.path);
    if (found == pages_.end()) {
      return {404, "text/plain; charset=utf-8",
              "This weftd was built without its console's pages. Build with Node and npm, or give "
              "--console-files.\n"};
    }
    const PageFile& file = found->second;
    HttpReply reply{200, file.type, file.bytes};
    const bool compresses =
        !file.gzip.empty() && absl::StrContains(exchange.Header("Accept-Encoding"), "gzip");
    if (compresses) {
      reply.body = file.gzip;
      reply.headers.emplace_back("Content-Encoding", "gzip");
    }
    reply.headers.emplace_back("Vary", "Accept-Encoding");
    reply.headers.emplace_back("ETag", file.tag);
    reply.headers.emplace_back("Cache-Control",
                               file.is_hashed ? "public, max-age=31536000, immutable" : "no-cache");
    if (exchange.Header("If-None-Match") == file.tag) {
      reply.status = 304;
      reply.body.clear();
    }
    return reply;
  }

  asio::awaitable<void> LogIn(HttpExchange& exchange) {
    const std::optional<std::string> body = co_await ReadJson(exchange);
    if (!body) co_return;
    v1::ConsoleLogin login;
    absl::Status status = FromJson(*body, login);
    // What was sent may be a token with a slip of the pen: it is not quoted.
    if (!status.ok()) status = absl::InvalidArgumentError("a ConsoleLogin is asked for");
    using BegunOr = absl::StatusOr<BrowserSessions::Begun>;
    const BegunOr begun = status.ok() ? sessions_.Begin(login.token(), exchange.peer) : BegunOr(status);
    v1::AuditEntry entry;
    entry.set_peer(exchange.peer);
    entry.set_method("POST /login");
    entry.set_outcome(absl::StatusCodeToString(begun.status().code()));
    if (!begun.ok()) {
      entry.set_message(EscapedText(std::string(begun.status().message())));
      if (audit_.Refused(entry))
        spdlog::warn("refused: {} of {}: {}", entry.method(), entry.peer(), entry.message());
      co_await exchange.Send(ErrorReply(begun.status()));
      co_return;
    }
    exchange.recognize(begun->session.caller.name);
    entry.set_caller(EscapedText(begun->session.caller.name));
    audit_.Record(entry);
    HttpReply reply = UserReply(begun->session);
    reply.headers.emplace_back(
        "Set-Cookie",
        CookieText(exchange, begun->id,
                   std::chrono::duration_cast<std::chrono::seconds>(BrowserSessions::kLasts).count()));
    co_await exchange.Send(std::move(reply));
  }

  // Only what no form of another site can send. None: it was answered.
  static asio::awaitable<std::optional<std::string>> ReadJson(HttpExchange& exchange) {
    if (!absl::StartsWith(exchange.Header("Content-Type"), "application/json")) {
      HttpReply reply = ErrorReply(absl::InvalidArgumentError("Content-Type: must be application/json"));
      reply.status = 415;
      co_await exchange.Send(std::move(reply));
      co_return std::nullopt;
    }
    co_return co_await exchange.ReadBody();
  }

  asio::awaitable<void> CallMethod(HttpExchange& exchange, std::string name, CallFor caller) {
    const google::protobuf::MethodDescriptor* method = FindMethod(name);
    if (method == nullptr || method->server_streaming()) {
      co_await exchange.Send(ErrorReply(absl::UnimplementedError(
          absl::StrCat(EscapedText(name), ": there is no such method with one answer"))));
      co_return;
    }
    const std::optional<std::string> body = co_await ReadJson(exchange);
    if (!body) co_return;
    const absl::StatusOr<std::string> request = RequestOfJson(*method->input_type(), *body);
    const absl::StatusOr<std::shared_ptr<DaemonCalls::Call>> call =
        calls_->Begin(caller, PathOf(*method), request, kCallPatience);
    if (!call.ok()) {
      co_await exchange.Send(ErrorReply(call.status()));
      co_return;
    }
    std::string answer, more;
    if (co_await (*call)->Read(answer)) co_await (*call)->Read(more);
    const absl::Status status = co_await (*call)->Finish();
    if (!status.ok()) {
      co_await exchange.Send(ErrorReply(status));
      co_return;
    }
    const absl::StatusOr<std::string> json = JsonOfAnswer(*method->output_type(), answer);
    HttpReply reply = json.ok() ? HttpReply{.body = *json} : ErrorReply(json.status());
    co_await exchange.Send(std::move(reply));
  }

  HttpReply UserReply(const BrowserSession& session) const {
    v1::ConsoleUser user;
    user.set_caller(session.caller.name);
    user.set_role(session.caller.role);
    user.set_expires_unix_ns(session.expires_unix_ns);
    user.set_weft_version(options_.version);
    return {.body = JsonOf(user)};
  }

  // Browsers accept a name with __Host- only with Secure and for the whole host (RFC 6265bis).
  std::string CookieName(const HttpExchange& exchange) const {
    return absl::StrCat(exchange.uses_tls ? "__Host-" : "", "weft_", options_.cookie_suffix);
  }
  std::string CookieOf(const HttpExchange& exchange) const {
    return CookieValue(exchange.Header("Cookie"), CookieName(exchange));
  }
  std::string CookieText(const HttpExchange& exchange, const std::string& value, int64_t seconds) const {
    return absl::StrCat(CookieName(exchange), "=", value,
                        "; Path=/; HttpOnly; SameSite=Strict; Max-Age=", seconds,
                        exchange.uses_tls ? "; Secure" : "");
  }

  const ConsoleOptions options_;
  AuditLog& audit_;
  BrowserSessions sessions_;
  std::map<std::string, PageFile> pages_;
  std::unique_ptr<DaemonCalls> calls_;
  MeshDownloads meshes_;
  std::unique_ptr<HttpListener> listener_;
};

absl::StatusOr<std::unique_ptr<Console>> Console::Start(UniqueFd socket, ConsoleOptions options,
                                                        const Sources& sources) {
  auto impl = std::make_unique<Impl>(std::move(options), sources);
  WEFT_RETURN_IF_ERROR(impl->Begin(std::move(socket)));
  return std::unique_ptr<Console>(new Console(std::move(impl)));
}

Console::Console(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Console::~Console() = default;

}  // namespace weft
