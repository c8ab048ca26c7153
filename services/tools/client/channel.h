// Channels to a daemon.
#pragma once

#include <grpcpp/channel.h>

#include <memory>
#include <string>

#include "absl/status/statusor.h"

namespace weft {

// How a client shows who it is. Files, so that no secret stands in arguments or logs.
struct ClientIdentity {
  std::string token_file;   // the token; empty: none
  std::string authority;    // certificates that vouch for the daemon, PEM; empty: those of this machine
  std::string certificate;  // the client's own, PEM; empty: none
  std::string key;          // of the certificate, PEM

  // WEFT_TOKEN_FILE, WEFT_TLS_CA, WEFT_TLS_CERT and WEFT_TLS_KEY.
  static ClientIdentity FromEnvironment();
};

// Whether calls of HOST are TLS: what leaves this machine is, and so is all where an authority is named.
bool UsesTls(const std::string& host, const ClientIdentity& identity);

// To "unix:PATH" or HOST:PORT. TLS as above. InvalidArgument: not an address, or a certificate without its
// key. Errors of ReadWholeFile besides; they name the variable.
absl::StatusOr<std::shared_ptr<grpc::Channel>> OpenChannel(const std::string& server,
                                                           const ClientIdentity& identity);

}  // namespace weft
