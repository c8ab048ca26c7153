#include "services/server/access/certificate_life.h"

#include <openssl/bio.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <ctime>
#include <memory>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"

namespace weft {
namespace {

constexpr uint64_t kLargestCertificateBytes = uint64_t{1} << 20;

std::string NameText(const X509_NAME* name) {
  const std::unique_ptr<BIO, decltype(&BIO_free)> text(BIO_new(BIO_s_mem()), &BIO_free);
  X509_NAME_print_ex(text.get(), name, 0, XN_FLAG_ONELINE & ~ASN1_STRFLGS_ESC_MSB);
  char* bytes = nullptr;
  const long size = BIO_get_mem_data(text.get(), &bytes);
  return std::string(bytes, static_cast<size_t>(size));
}

int64_t UnixTime(const ASN1_TIME* time) {
  std::tm parts{};
  if (time == nullptr || ASN1_TIME_to_tm(time, &parts) != 1) return 0;
  return timegm(&parts);
}

}  // namespace

absl::StatusOr<std::vector<CertificateLife>> LivesOfCertificates(const std::string& path) {
  WEFT_ASSIGN_OR_RETURN(const std::string text, ReadWholeFile(path, kLargestCertificateBytes));
  const std::unique_ptr<BIO, decltype(&BIO_free)> file(
      BIO_new_mem_buf(text.data(), static_cast<int>(text.size())), &BIO_free);
  const auto release = [](STACK_OF(X509_INFO) * infos) { sk_X509_INFO_pop_free(infos, X509_INFO_free); };
  const std::unique_ptr<STACK_OF(X509_INFO), decltype(release)> infos(
      PEM_X509_INFO_read_bio(file.get(), nullptr, nullptr, nullptr), release);
  std::vector<CertificateLife> lives;
  for (int i = 0; infos != nullptr && i < sk_X509_INFO_num(infos.get()); ++i) {
    const X509_INFO* info = sk_X509_INFO_value(infos.get(), i);
    if (info->x509 != nullptr) {
      lives.push_back(
          {NameText(X509_get_subject_name(info->x509)), UnixTime(X509_get0_notAfter(info->x509))});
    }
    if (info->crl != nullptr) {
      lives.push_back({"revocation list of " + NameText(X509_CRL_get_issuer(info->crl)),
                       UnixTime(X509_CRL_get0_nextUpdate(info->crl))});
    }
  }
  if (!lives.empty()) return lives;
  return absl::InvalidArgumentError(absl::StrCat(path, ": no certificate or revocation list in PEM"));
}

}  // namespace weft
