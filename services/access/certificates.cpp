#include "services/access/certificates.h"

#include <openssl/bio.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <sys/stat.h>

#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "services/access/file_stamp.h"
#include "services/files/atomic_file.h"

namespace weft {
namespace {

constexpr uint64_t kLargestPemBytes = 16 << 20;

using Bio = std::unique_ptr<BIO, decltype(&BIO_free)>;
using Certificate = std::unique_ptr<X509, decltype(&X509_free)>;
using Key = std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)>;
using Crl = std::unique_ptr<X509_CRL, decltype(&X509_CRL_free)>;

Bio Reader(const std::string& text) {
  return {BIO_new_mem_buf(text.data(), static_cast<int>(text.size())), &BIO_free};
}

Certificate FirstCertificate(const std::string& text) {
  return {PEM_read_bio_X509(Reader(text).get(), nullptr, nullptr, nullptr), &X509_free};
}

std::vector<Crl> ReadCrls(const std::string& text) {
  std::vector<Crl> crls;
  const Bio reader = Reader(text);
  while (X509_CRL* crl = PEM_read_bio_X509_CRL(reader.get(), nullptr, nullptr, nullptr))
    crls.emplace_back(crl, &X509_CRL_free);
  return crls;
}

// Nobody is there to type a passphrase.
int NoPassphrase(char*, int, int, void*) { return 0; }

absl::StatusOr<std::string> ReadOption(const char* option, const std::string& path) {
  absl::StatusOr<std::string> text = ReadWholeFile(path, kLargestPemBytes);
  if (text.ok()) return text;
  return absl::Status(text.status().code(), absl::StrCat(option, ": ", text.status().message()));
}

absl::Status NotPem(const char* option, const std::string& path, const char* what) {
  return absl::InvalidArgumentError(absl::StrCat(option, ": ", path, ": no ", what, " in PEM"));
}

absl::Status CheckKey(const std::string& path, X509* certificate) {
  const absl::StatusOr<std::string> text = ReadOption("--tls-key", path);
  if (!text.ok()) return text.status();
  struct stat file = {};
  if (stat(path.c_str(), &file) == 0 && (file.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
    return absl::PermissionDeniedError(absl::StrCat(
        "--tls-key: ", path, ": other users may read the key; close it by `chmod go-rwx ", path, "`"));
  }
  const Key key(PEM_read_bio_PrivateKey(Reader(*text).get(), nullptr, NoPassphrase, nullptr), &EVP_PKEY_free);
  if (key == nullptr) return NotPem("--tls-key", path, "private key without a passphrase");
  if (X509_check_private_key(certificate, key.get()) == 1) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("--tls-key: ", path, ": this is the key of another certificate"));
}

}  // namespace

absl::Status CheckTlsFiles(const TlsFiles& files) {
  const absl::StatusOr<std::string> chain = ReadOption("--tls-cert", files.certificate);
  if (!chain.ok()) return chain.status();
  const Certificate certificate = FirstCertificate(*chain);
  if (certificate == nullptr) return NotPem("--tls-cert", files.certificate, "certificate");
  if (absl::Status status = CheckKey(files.key, certificate.get()); !status.ok()) return status;
  if (!files.client_authority.empty()) {
    const absl::StatusOr<std::string> text = ReadOption("--tls-client-ca", files.client_authority);
    if (!text.ok()) return text.status();
    if (FirstCertificate(*text) == nullptr)
      return NotPem("--tls-client-ca", files.client_authority, "certificate");
  }
  if (files.client_revocations.empty()) return absl::OkStatus();
  const absl::StatusOr<std::string> text = ReadOption("--tls-client-crl", files.client_revocations);
  if (!text.ok()) return text.status();
  if (ReadCrls(*text).empty()) return NotPem("--tls-client-crl", files.client_revocations, "revocation list");
  return absl::OkStatus();
}

struct RevocationList::Lists {
  std::vector<Crl> crls;
};

RevocationList::RevocationList(std::string path, Warn warn)
    : path_(std::move(path)), warn_(std::move(warn)) {}

RevocationList::~RevocationList() = default;

std::shared_ptr<const RevocationList::Lists> RevocationList::Current() {
  const std::lock_guard lock(mutex_);
  std::string stamp = FileStamp(path_);
  if (stamp == stamp_) return lists_;
  stamp_ = std::move(stamp);
  auto lists = std::make_shared<Lists>();
  const absl::StatusOr<std::string> text = ReadWholeFile(path_, kLargestPemBytes);
  if (text.ok()) lists->crls = ReadCrls(*text);
  if (lists->crls.empty()) {
    const std::string why =
        text.ok() ? absl::StrCat(path_, ": no revocation list in PEM") : std::string(text.status().message());
    warn_(absl::StrCat(why, "; no certificate is accepted until then"));
  }
  lists_ = std::move(lists);
  return lists_;
}

bool RevocationList::IsRevoked(const std::string& certificate) {
  const std::shared_ptr<const Lists> lists = Current();
  const Certificate parsed = FirstCertificate(certificate);
  if (parsed == nullptr || lists->crls.empty()) return true;
  for (const Crl& crl : lists->crls) {
    X509_REVOKED* entry = nullptr;
    // 2: the entry takes a revocation back (X509_CRL_get0_by_cert(3)).
    if (X509_NAME_cmp(X509_CRL_get_issuer(crl.get()), X509_get_issuer_name(parsed.get())) == 0 &&
        X509_CRL_get0_by_cert(crl.get(), &entry, parsed.get()) == 1) {
      return true;
    }
  }
  return false;
}

}  // namespace weft
