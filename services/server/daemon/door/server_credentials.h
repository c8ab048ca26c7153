// What gRPC asks of connections before their first call.
#pragma once

#include <grpcpp/security/server_credentials.h>
#include <grpcpp/security/tls_certificate_provider.h>

#include <memory>

#include "services/server/access/certificates.h"
#include "services/server/daemon/door/listen_address.h"

namespace weft {

// Files of TLS are read again every few seconds: new connections get the new certificate. Thread safety:
// none.
class ServerCredentialsMaker {
 public:
  explicit ServerCredentialsMaker(TlsFiles files);

  // Connections within this machine are plain. Those from a network are TLS; a certificate that the client
  // shows must be of the client authority.
  std::shared_ptr<grpc::ServerCredentials> Make(ListenKind kind);

 private:
  const TlsFiles files_;
  std::shared_ptr<grpc::experimental::CertificateProviderInterface> provider_;
};

}  // namespace weft
