// Metrics over HTTP, for those who may look.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "services/server/access/access_control.h"
#include "services/server/access/audit_log.h"
#include "services/server/access/certificates.h"
#include "services/server/console/http_listener.h"
#include "services/server/daemon/door/listen_address.h"
#include "services/server/daemon/program/metrics.h"

namespace weft {

struct MetricsPageSources {
  Metrics& metrics;
  AccessControl& access;
  AuditLog& audit;
  std::vector<std::string> host_names;  // of weftd --console-host
};

// Serves /metrics to whoever shows a token (the role viewer is enough), also on loopback: the user of an HTTP
// connection is not looked up. Refusals are recorded. Addresses that other machines reach have the daemon's
// TLS. Errors of HttpListener::Start. What `sources` names must outlive the page.
absl::StatusOr<std::unique_ptr<HttpListener>> ServeMetricsPage(ListeningSocket socket, const TlsFiles& tls,
                                                               const MetricsPageSources& sources);

}  // namespace weft
