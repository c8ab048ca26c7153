#include "services/server/access/certificates.h"

#include <openssl/bio.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>
#include <sys/stat.h>

#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/named_status.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"
#include "services/server/access/file_stamp.h"

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
  return Naming(option, text.status());
}

absl::Status NotPem(const char* option, const std::string& path, const char* what) {
  return absl::InvalidArgumentError(absl::StrCat(option, ": ", path, ": no ", what, " in PEM"));
}

std::string TimeText(const ASN1_TIME* time) {
  const Bio text(BIO_new(BIO_s_mem()), &BIO_free);
  ASN1_TIME_print(text.get(), time);
  char* bytes = nullptr;
  const long size = BIO_get_mem_data(text.get(), &bytes);
  return {bytes, static_cast<size_t>(size)};
}

// No client connects to a server whose certificate has another time.
absl::Status CheckValidity(const std::string& path, const X509* certificate) {
  const ASN1_TIME* begin = X509_get0_notBefore(certificate);
  const ASN1_TIME* end = X509_get0_notAfter(certificate);
  if (X509_cmp_current_time(end) < 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("--tls-cert: ", path, ": the certificate expired on ", TimeText(end), "; renew it"));
  }
  if (X509_cmp_current_time(begin) <= 0) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("--tls-cert: ", path, ": the certificate is valid from ",
                                                 TimeText(begin), " on; is this machine's clock right?"));
}

absl::Status CheckKey(const std::string& path, X509* certificate) {
  WEFT_ASSIGN_OR_RETURN(const std::string text, ReadOption("--tls-key", path));
  struct stat file = {};
  if (stat(path.c_str(), &file) == 0 && (file.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
    return absl::PermissionDeniedError(absl::StrCat(
        "--tls-key: ", path, ": other users may read the key; close it by `chmod go-rwx ", path, "`"));
  }
  const Key key(PEM_read_bio_PrivateKey(Reader(text).get(), nullptr, NoPassphrase, nullptr), &EVP_PKEY_free);
  if (key == nullptr) return NotPem("--tls-key", path, "private key without a passphrase");
  if (X509_check_private_key(certificate, key.get()) == 1) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("--tls-key: ", path, ": this is the key of another certificate"));
}

}  // namespace

absl::Status CheckTlsFiles(const TlsFiles& files) {
  WEFT_ASSIGN_OR_RETURN(const std::string chain, ReadOption("--tls-cert", files.certificate));
  const Certificate certificate = FirstCertificate(chain);
  if (certificate == nullptr) return NotPem("--tls-cert", files.certificate, "certificate");
  WEFT_RETURN_IF_ERROR(CheckValidity(files.certificate, certificate.get()));
  WEFT_RETURN_IF_ERROR(CheckKey(files.key, certificate.get()));
  if (!files.client_authority.empty()) {
    WEFT_ASSIGN_OR_RETURN(const std::string text, ReadOption("--tls-client-ca", files.client_authority));
    if (FirstCertificate(text) == nullptr)
      return NotPem("--tls-client-ca", files.client_authority, "certificate");
  }
  if (files.client_revocations.empty()) return absl::OkStatus();
  WEFT_ASSIGN_OR_RETURN(const std::string text, ReadOption("--tls-client-crl", files.client_revocations));
  if (ReadCrls(text).empty()) return NotPem("--tls-client-crl", files.client_revocations, "revocation list");
  return absl::OkStatus();
}

std::vector<std::string> NamesOfCertificate(const std::string& path) {
  const absl::StatusOr<std::string> text = ReadWholeFile(path, kLargestPemBytes);
  const Certificate certificate = text.ok() ? FirstCertificate(*text) : Certificate(nullptr, &X509_free);
  if (certificate == nullptr) return {};
  using Names = std::unique_ptr<GENERAL_NAMES, decltype(&GENERAL_NAMES_free)>;
  const Names names(static_cast<GENERAL_NAMES*>(
                        X509_get_ext_d2i(certificate.get(), NID_subject_alt_name, nullptr, nullptr)),
                    &GENERAL_NAMES_free);
  std::vector<std::string> dns;
  for (int i = 0; names != nullptr && i < sk_GENERAL_NAME_num(names.get()); ++i) {
    const GENERAL_NAME* name = sk_GENERAL_NAME_value(names.get(), i);
    if (name->type != GEN_DNS) continue;
    const ASN1_STRING* value = name->d.dNSName;
    dns.emplace_back(reinterpret_cast<const char*>(ASN1_STRING_get0_data(value)),
                     static_cast<size_t>(ASN1_STRING_length(value)));
  }
  return dns;
}

struct RevocationList::Lists {
  std::vector<Crl> crls;
};

RevocationList::RevocationList(std::string path, Warn warn)
    : path_(std::move(path)), warn_(std::move(warn)) {}

RevocationList::~RevocationList() = default;

std::shared_ptr<const RevocationList::Lists> RevocationList::Current() {
  const MutexLock lock(mutex_);
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
