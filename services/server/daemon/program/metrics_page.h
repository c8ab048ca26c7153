// Metrics over HTTP, for those who may look.
#pragma once

#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/statusor.h"
#include "services/server/access/access_control.h"
#include "services/server/access/audit_log.h"
#include "services/server/access/certificates.h"
#include "services/server/daemon/door/listen_address.h"
#include "services/server/daemon/program/metrics.h"
#include "services/server/http/http_server.h"

namespace weft {

struct MetricsPageSources {
  Metrics& metrics;
  AccessControl& access;
  AuditLog& audit;
  std::vector<std::string> host_names;  // of weftd --console-host
};

// Serves /metrics to whoever shows a token (the role viewer is enough), also on loopback: the user of an HTTP
// connection is not looked up. Refusals are recorded. Addresses that other machines reach have the daemon's
// TLS, whose files are read again when they change.
class MetricsPage {
 public:
  // Errors of HttpServer::Start and ReadWholeFile.
  static absl::StatusOr<std::unique_ptr<MetricsPage>> Start(ListeningSocket socket, TlsFiles tls,
                                                            const MetricsPageSources& sources);

 private:
  MetricsPage(TlsFiles tls, const MetricsPageSources& sources) : tls_(std::move(tls)), sources_(sources) {}
  HttpAnswer Answer(const HttpRequest& request);
  void FollowCertificate(const std::stop_token& stop);

  const TlsFiles tls_;
  const MetricsPageSources sources_;
  std::unique_ptr<HttpServer> server_;
  std::jthread certificate_;
};

}  // namespace weft
