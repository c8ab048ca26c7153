#include "services/tools/client/connection_fault.h"

#include <fcntl.h>
#include <netdb.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <memory>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "services/ground/process/unique_fd.h"

namespace weft {
namespace {

constexpr int kConnectTimeout_s = 3;

using Context = std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)>;
using Session = std::unique_ptr<SSL, decltype(&SSL_free)>;
using Names = std::unique_ptr<GENERAL_NAMES, decltype(&GENERAL_NAMES_free)>;

bool IsConnected(int fd) {
  pollfd ready = {fd, POLLOUT, 0};
  int error = 0;
  socklen_t bytes = sizeof error;
  return poll(&ready, 1, kConnectTimeout_s * 1000) == 1 &&
         getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &bytes) == 0 && error == 0;
}

// Blocking, with a timeout; closed where nothing listens.
UniqueFd ConnectTo(const std::string& host, const std::string& port) {
  addrinfo hints = {}, *found = nullptr;
  hints.ai_socktype = SOCK_STREAM;
  if (getaddrinfo(host.c_str(), port.c_str(), &hints, &found) != 0) return UniqueFd();
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> addresses(found, &freeaddrinfo);
  for (const addrinfo* one = found; one != nullptr; one = one->ai_next) {
    UniqueFd fd(socket(one->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    if (!fd.open()) continue;
    if (connect(fd.get(), one->ai_addr, one->ai_addrlen) != 0 && errno != EINPROGRESS) continue;
    if (!IsConnected(fd.get())) continue;
    const timeval patience = {kConnectTimeout_s, 0};
    setsockopt(fd.get(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    setsockopt(fd.get(), SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
    fcntl(fd.get(), F_SETFL, fcntl(fd.get(), F_GETFL) & ~O_NONBLOCK);
    return fd;
  }
  return UniqueFd();
}

std::string TextOf(const ASN1_STRING* text) {
  return {reinterpret_cast<const char*>(ASN1_STRING_get0_data(text)),
          static_cast<size_t>(ASN1_STRING_length(text))};
}

std::string NamesIn(const X509* certificate) {
  const Names names(
      static_cast<GENERAL_NAMES*>(X509_get_ext_d2i(certificate, NID_subject_alt_name, nullptr, nullptr)),
      &GENERAL_NAMES_free);
  std::vector<std::string> listed;
  for (int i = 0; names != nullptr && i < sk_GENERAL_NAME_num(names.get()); ++i) {
    const GENERAL_NAME* name = sk_GENERAL_NAME_value(names.get(), i);
    if (name->type == GEN_DNS) listed.push_back(TextOf(name->d.dNSName));
    if (name->type == GEN_IPADD) listed.push_back("an address");
  }
  return listed.empty() ? "no name" : absl::StrJoin(listed, ", ");
}

std::string WhenOf(const ASN1_TIME* time) {
  const std::unique_ptr<BIO, decltype(&BIO_free)> text(BIO_new(BIO_s_mem()), &BIO_free);
  ASN1_TIME_print(text.get(), time);
  char* bytes = nullptr;
  const long size = BIO_get_mem_data(text.get(), &bytes);
  return {bytes, static_cast<size_t>(size)};
}

std::string WordsFor(long verified, const X509* certificate, const std::string& host) {
  switch (verified) {
    case X509_V_OK:
      return "";
    case X509_V_ERR_CERT_HAS_EXPIRED:
      return absl::StrCat("its certificate expired on ", WhenOf(X509_get0_notAfter(certificate)),
                          "; renew the file of weftd --tls-cert there");
    case X509_V_ERR_CERT_NOT_YET_VALID:
      return absl::StrCat("its certificate is valid from ", WhenOf(X509_get0_notBefore(certificate)),
                          " on; compare the clocks of both machines");
    case X509_V_ERR_HOSTNAME_MISMATCH:
    case X509_V_ERR_IP_ADDRESS_MISMATCH:
      return absl::StrCat("its certificate is for ", NamesIn(certificate), ", not for ", host,
                          "; connect by a name that it has, or have it made for this one, too");
    case X509_V_ERR_DEPTH_ZERO_SELF_SIGNED_CERT:
    case X509_V_ERR_SELF_SIGNED_CERT_IN_CHAIN:
    case X509_V_ERR_UNABLE_TO_GET_ISSUER_CERT:
    case X509_V_ERR_UNABLE_TO_GET_ISSUER_CERT_LOCALLY:
    case X509_V_ERR_UNABLE_TO_VERIFY_LEAF_SIGNATURE:
      return "no authority that is known here vouches for its certificate; set WEFT_TLS_CA to the "
             "authority's "
             "certificate";
    default:
      return absl::StrCat("its certificate is refused: ", X509_verify_cert_error_string(verified));
  }
}

// A peer that closes must not end this program: OpenSSL writes without MSG_NOSIGNAL.
class WithoutPipeSignals {
 public:
  WithoutPipeSignals() {
    sigemptyset(&pipe_);
    sigaddset(&pipe_, SIGPIPE);
    pthread_sigmask(SIG_BLOCK, &pipe_, &before_);
  }
  ~WithoutPipeSignals() {
    constexpr timespec kNow = {0, 0};
    while (sigtimedwait(&pipe_, nullptr, &kNow) > 0) {
    }
    pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }
  WithoutPipeSignals(const WithoutPipeSignals&) = delete;
  WithoutPipeSignals& operator=(const WithoutPipeSignals&) = delete;

 private:
  sigset_t pipe_, before_;
};

struct Handshake {
  bool speaks_tls = false;
  std::string fault;  // of its certificate
};

Handshake ShakeHands(const UniqueFd& fd, const std::string& host, const ClientIdentity& identity) {
  const Context context(SSL_CTX_new(TLS_client_method()), &SSL_CTX_free);
  if (identity.authority.empty()) {
    SSL_CTX_set_default_verify_paths(context.get());
  } else {
    SSL_CTX_load_verify_locations(context.get(), identity.authority.c_str(), nullptr);
  }
  const Session session(SSL_new(context.get()), &SSL_free);
  SSL_set_verify(session.get(), SSL_VERIFY_NONE, nullptr);  // the result is looked at afterwards
  X509_VERIFY_PARAM* checks = SSL_get0_param(session.get());
  if (X509_VERIFY_PARAM_set1_ip_asc(checks, host.c_str()) != 1) SSL_set1_host(session.get(), host.c_str());
  SSL_set_tlsext_host_name(session.get(), host.c_str());
  SSL_set_fd(session.get(), fd.get());
  if (SSL_connect(session.get()) != 1) return {};
  const std::unique_ptr<X509, decltype(&X509_free)> certificate(SSL_get1_peer_certificate(session.get()),
                                                                &X509_free);
  if (certificate == nullptr) return {};
  return {true, WordsFor(SSL_get_verify_result(session.get()), certificate.get(), host)};
}

}  // namespace

std::string FindConnectionFault(const std::string& server, const ClientIdentity& identity) {
  const size_t colon = server.rfind(':');
  if (server.rfind("unix:", 0) == 0 || colon == std::string::npos) return "";
  std::string host = server.substr(0, colon);
  const bool uses_tls = UsesTls(host, identity);
  if (host.size() > 1 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  const UniqueFd fd = ConnectTo(host, server.substr(colon + 1));
  if (!fd.open()) return "";
  const WithoutPipeSignals quiet;
  const Handshake seen = ShakeHands(fd, host, identity);
  if (uses_tls && !seen.speaks_tls) {
    return absl::StrCat(
        "what listens there speaks no TLS; start weftd there with --tls-cert and --tls-key",
        identity.authority.empty() ? "" : ", or unset WEFT_TLS_CA where both run on one machine");
  }
  if (!uses_tls && seen.speaks_tls)
    return "what listens there speaks TLS; set WEFT_TLS_CA to the certificate of its authority";
  return uses_tls ? seen.fault : "";
}

}  // namespace weft
