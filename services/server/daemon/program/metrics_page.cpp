#include "services/server/daemon/program/metrics_page.h"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <utility>

#include "absl/strings/str_cat.h"
#include "capture/file/plain_text.h"

namespace weft {
namespace {

constexpr char kPath[] = "/metrics";
constexpr char kPlain[] = "text/plain; charset=utf-8";

HttpReply ReplyOfMetrics(HttpExchange& exchange, const MetricsPageSources& sources) {
  const std::string token = BearerOf(exchange.Header("Authorization"));
  const absl::StatusOr<Caller> caller = sources.access.Identify({"", token, ""});
  if (!caller.ok()) {
    v1::AuditEntry entry;
    entry.set_peer(exchange.peer);
    entry.set_method("GET /metrics");
    entry.set_outcome(absl::StatusCodeToString(caller.status().code()));
    entry.set_message(EscapedText(std::string(caller.status().message())));
    if (sources.audit.Refused(entry))
      spdlog::warn("refused: {} of {}: {}", entry.method(), entry.peer(), entry.message());
    return {401, kPlain, absl::StrCat(caller.status().message(), "\n"), {{"WWW-Authenticate", "Bearer"}}};
  }
  if (exchange.target.path != kPath) return {404, kPlain, absl::StrCat("there is ", kPath, " here\n")};
  exchange.recognize(token);
  return {200, Metrics::kType, sources.metrics.Text()};
}

}  // namespace

absl::StatusOr<std::unique_ptr<HttpListener>> ServeMetricsPage(ListeningSocket socket, const TlsFiles& tls,
                                                               const MetricsPageSources& sources) {
  HttpListenerOptions options;
  options.name = kPath;
  options.tokens_vouch = true;
  char name[HOST_NAME_MAX + 1] = "";
  if (gethostname(name, sizeof name - 1) == 0) options.host_names.emplace_back(name);
  options.host_names.insert(options.host_names.end(), sources.host_names.begin(), sources.host_names.end());
  options.tls = tls;
  options.uses_tls = socket.kind == ListenKind::kNetwork;
  options.door = {.all = 64, .kept = 32, .of_one_peer = 16};
  options.patience = options.idle = options.stranger_patience = std::chrono::seconds(10);
  options.threads = 1;
  return HttpListener::Start(std::move(socket.socket), std::move(options),
                             HttpListener::Answering([sources](HttpExchange& exchange) {
                               return ReplyOfMetrics(exchange, sources);
                             }));
}

}  // namespace weft
