// Certificates of servers and clients, as OpenSSL reads them.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "base/mutex.h"

namespace weft {

struct TlsFiles {
  std::string certificate;         // chain of the server, PEM
  std::string key;                 // of the certificate, PEM
  std::string client_authority;    // certificates that vouch for clients, PEM; empty: clients show tokens
  std::string client_revocations;  // list of the authority's that are valid no more, PEM; empty: none
};

// Whether a server can begin with these. InvalidArgument names option and file: not readable, not PEM, a key
// of another certificate, or a certificate that is not valid at this time. PermissionDenied: other users may
// read the key.
absl::Status CheckTlsFiles(const TlsFiles& files);

// The DNS names of a server's certificate, "*.studio.example" among them; none where it cannot be read.
std::vector<std::string> NamesOfCertificate(const std::string& path);

// Certificates that an authority has revoked. Takes changes of the file. While it cannot be read, every
// certificate counts as revoked, which `warn` is told. Thread safety: any thread.
class RevocationList {
 public:
  using Warn = std::function<void(const std::string& message)>;
  RevocationList(std::string path, Warn warn);
  ~RevocationList();

  // Of a certificate in PEM; one that is none counts as revoked.
  bool IsRevoked(const std::string& certificate);

 private:
  struct Lists;

  std::shared_ptr<const Lists> Current();

  const std::string path_;
  const Warn warn_;
  Mutex mutex_;
  std::string stamp_ ABSL_GUARDED_BY(mutex_);
  std::shared_ptr<const Lists> lists_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace weft
