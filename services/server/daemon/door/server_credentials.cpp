#include "services/server/daemon/door/server_credentials.h"

#include <grpcpp/security/tls_credentials_options.h>

#include <cstdlib>
#include <utility>

namespace weft {
namespace {

constexpr unsigned kReadAgain_s = 5;
// gRPC takes TLS 1.2 and 1.3, with forward secrecy and ciphers that authenticate what they encrypt. This
// variable of the environment would weaken that.
constexpr char kCiphersVariable[] = "GRPC_SSL_CIPHER_SUITES";

}  // namespace

ServerCredentialsMaker::ServerCredentialsMaker(TlsFiles files) : files_(std::move(files)) {}

std::shared_ptr<grpc::ServerCredentials> ServerCredentialsMaker::Make(ListenKind kind) {
  using grpc::experimental::FileWatcherCertificateProvider;
  if (kind == ListenKind::kUnixSocket || kind == ListenKind::kConsole)
    return grpc::experimental::LocalServerCredentials(UDS);
  if (kind == ListenKind::kLoopback) return grpc::experimental::LocalServerCredentials(LOCAL_TCP);
  if (std::getenv(kCiphersVariable) != nullptr) unsetenv(kCiphersVariable);
  const bool knows_clients = !files_.client_authority.empty();
  if (provider_ == nullptr && knows_clients) {
    provider_ = std::make_shared<FileWatcherCertificateProvider>(files_.key, files_.certificate,
                                                                 files_.client_authority, kReadAgain_s);
  } else if (provider_ == nullptr) {
    provider_ =
        std::make_shared<FileWatcherCertificateProvider>(files_.key, files_.certificate, kReadAgain_s);
  }
  grpc::experimental::TlsServerCredentialsOptions options(provider_);
  options.watch_identity_key_cert_pairs();
  if (knows_clients) options.watch_root_certs();
  options.set_cert_request_type(knows_clients ? GRPC_SSL_REQUEST_CLIENT_CERTIFICATE_AND_VERIFY
                                              : GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE);
  return grpc::experimental::TlsServerCredentials(options);
}

}  // namespace weft
