// Certificates for tests: an authority, what it signs, and what it takes back. By OpenSSL.
#pragma once

#include <openssl/x509.h>

#include <memory>
#include <string>

namespace weft {

struct CertificateFiles {
  std::string certificate, key;  // paths
};

// Writes to a folder. Ends the test program where OpenSSL fails.
class CertificateMaker {
 public:
  // Names the authority, whose certificate is `authority()`.
  CertificateMaker(std::string folder, const std::string& name);

  const std::string& authority() const { return authority_.certificate; }
  // Valid for so many days from `from_days` after now on, for `names` as OpenSSL writes them.
  CertificateFiles Sign(const std::string& common_name, int days = 30,
                        const std::string& names = "IP:127.0.0.1,DNS:localhost", int from_days = -1);
  // Writes the list of what was revoked, to `path`.
  void Revoke(const CertificateFiles& certificate, const std::string& path);

 private:
  using Key = std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)>;
  using Certificate = std::unique_ptr<X509, decltype(&X509_free)>;

  Certificate Make(const std::string& common_name, EVP_PKEY* key, int days, const std::string& names,
                   int from_days);
  CertificateFiles Write(const std::string& name, X509* certificate, EVP_PKEY* key) const;

  const std::string folder_;
  Key key_;
  Certificate certificate_;
  CertificateFiles authority_;
  int made_ = 0;
  std::unique_ptr<X509_CRL, decltype(&X509_CRL_free)> revoked_;
};

}  // namespace weft
