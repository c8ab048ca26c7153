// The console: the daemon's pages for browsers, and its API as they can call it.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "services/ground/process/unique_fd.h"
#include "services/server/access/access_control.h"
#include "services/server/access/audit_log.h"
#include "services/server/access/certificates.h"

namespace weft {

struct ConsoleOptions {
  std::vector<std::string> host_names;  // as those of IsHostOfOurs
  TlsFiles tls;
  bool uses_tls = false;
  std::string page_folder;    // of the built pages; empty: the API alone
  std::string session_file;   // browsers that are logged in; need not be there
  std::string cookie_suffix;  // tells daemons of one machine apart, since cookies know no ports
  std::string version;
};

// POST /login takes a token for a cookie (HttpOnly, SameSite=Strict), POST /logout ends it, GET /session says
// whose it is. POST /api/<Service>/<Method> is any method with one answer, its messages as protobuf's JSON;
// GET /file/<Service>/<Method>?FIELD=VALUE any that sends a file; GET /mesh/<job>/<frame> a mesh to be drawn
// (mesh_download.h); /live a socket for streams (live_socket.h). All of them are calls of the daemon's API
// for the owner of the token.
class Console {
 public:
  struct Sources {
    AccessControl& access;
    AuditLog& audit;
    // A connection to the daemon as from this browser's address.
    std::function<absl::StatusOr<UniqueFd>(const std::string& peer)> connect;
  };
  // `socket` listens already. Errors of LoadPageFiles and HttpListener::Start.
  static absl::StatusOr<std::unique_ptr<Console>> Start(UniqueFd socket, ConsoleOptions options,
                                                        const Sources& sources);
  // Ends connections and calls; the daemon's server must still run.
  ~Console();

 private:
  class Impl;
  explicit Console(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace weft
