// How long certificates and lists of revoked ones are valid.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace weft {

struct CertificateLife {
  std::string subject;  // "CN = studio", or "revocation list" and its issuer
  int64_t ends_unix_s = 0;
};

// Of all certificates and revocation lists of a PEM file. InvalidArgument: it has none. Errors of
// ReadWholeFile besides.
absl::StatusOr<std::vector<CertificateLife>> LivesOfCertificates(const std::string& path);

}  // namespace weft
