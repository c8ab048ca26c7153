#include "services/server/daemon/program/metrics_page.h"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <chrono>
#include <climits>
#include <condition_variable>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/mutex.h"
#include "base/status_macros.h"
#include "capture/file/plain_text.h"
#include "services/formats/files/atomic_file.h"
#include "services/server/access/file_stamp.h"

namespace weft {
namespace {

constexpr char kPath[] = "/metrics";
constexpr char kPlain[] = "text/plain; charset=utf-8";
constexpr std::chrono::seconds kLookAtFilesEvery{5};

struct TlsTexts {
  std::string certificate, key;
};

absl::StatusOr<TlsTexts> ReadTls(const TlsFiles& files) {
  WEFT_ASSIGN_OR_RETURN(std::string certificate, ReadWholeFile(files.certificate));
  WEFT_ASSIGN_OR_RETURN(std::string key, ReadWholeFile(files.key));
  return TlsTexts{std::move(certificate), std::move(key)};
}

std::string StampOf(const TlsFiles& files) {
  return absl::StrCat(FileStamp(files.certificate), " ", FileStamp(files.key));
}

}  // namespace

absl::StatusOr<std::unique_ptr<MetricsPage>> MetricsPage::Start(ListeningSocket socket, TlsFiles tls,
                                                                const MetricsPageSources& sources) {
  std::unique_ptr<MetricsPage> page(new MetricsPage(std::move(tls), sources));
  HttpServerOptions options;
  char name[HOST_NAME_MAX + 1] = "";
  if (gethostname(name, sizeof name - 1) == 0) options.host_names.emplace_back(name);
  const bool uses_tls = socket.kind == ListenKind::kNetwork;
  options.host_names.insert(options.host_names.end(), sources.host_names.begin(), sources.host_names.end());
  if (uses_tls) {
    for (std::string& of_certificate : NamesOfCertificate(page->tls_.certificate))
      options.host_names.push_back(std::move(of_certificate));
    WEFT_ASSIGN_OR_RETURN(TlsTexts texts, ReadTls(page->tls_));
    options.certificate_pem = std::move(texts.certificate);
    options.key_pem = std::move(texts.key);
  }
  WEFT_ASSIGN_OR_RETURN(auto server, HttpServer::Start(std::move(socket.socket), std::move(options),
                                                       [self = page.get()](const HttpRequest& request) {
                                                         return self->Answer(request);
                                                       }));
  page->server_ = std::move(server);
  if (uses_tls) {
    page->certificate_ =
        std::jthread([self = page.get()](const std::stop_token& stop) { self->FollowCertificate(stop); });
  }
  return page;
}

HttpAnswer MetricsPage::Answer(const HttpRequest& request) {
  const absl::StatusOr<Caller> caller = sources_.access.Identify({"", request.token, ""});
  if (!caller.ok()) {
    v1::AuditEntry entry;
    entry.set_peer(request.peer);
    entry.set_method("GET /metrics");
    entry.set_outcome(absl::StatusCodeToString(caller.status().code()));
    entry.set_message(EscapedText(std::string(caller.status().message())));
    if (sources_.audit.Refused(entry))
      spdlog::warn("refused: {} of {}: {}", entry.method(), entry.peer(), entry.message());
    return {401, kPlain, absl::StrCat(caller.status().message(), "\n")};
  }
  if (request.path != kPath) return {404, kPlain, absl::StrCat("there is ", kPath, " here\n")};
  return {200, Metrics::kType, sources_.metrics.Text()};
}

void MetricsPage::FollowCertificate(const std::stop_token& stop) {
  Mutex mutex;
  std::condition_variable_any asked;
  MutexLock lock(mutex);
  std::string stamp = StampOf(tls_);
  while (!asked.wait_for(lock, stop, kLookAtFilesEvery, [&] { return stop.stop_requested(); })) {
    if (stop.stop_requested()) return;
    std::string now = StampOf(tls_);
    if (now == stamp) continue;
    stamp = std::move(now);
    const absl::StatusOr<TlsTexts> texts = ReadTls(tls_);
    const absl::Status changed =
        texts.ok() ? server_->ChangeCertificate(texts->certificate, texts->key) : texts.status();
    if (!changed.ok())
      spdlog::warn("{} keeps its old certificate: {}", kPath, EscapedText(std::string(changed.message())));
  }
}

}  // namespace weft
