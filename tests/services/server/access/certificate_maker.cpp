#include "tests/services/server/access/certificate_maker.h"

#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509v3.h>
#include <sys/stat.h>

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <utility>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

constexpr long kDay_s = 86400;

void Require(bool holds) {
  if (!holds) std::abort();
}

void SetName(X509_NAME* name, const std::string& common_name) {
  const auto* text = reinterpret_cast<const unsigned char*>(common_name.c_str());
  Require(X509_NAME_add_entry_by_txt(name, "CN", MBSTRING_ASC, text, -1, -1, 0) == 1);
}

void AddExtension(X509* certificate, X509* issuer, int kind, const char* value) {
  X509V3_CTX context;
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  X509_EXTENSION* extension = X509V3_EXT_conf_nid(nullptr, &context, kind, value);
  Require(extension != nullptr && X509_add_ext(certificate, extension, -1) == 1);
  X509_EXTENSION_free(extension);
}

template <typename Write>
void WritePem(const std::string& path, Write write) {
  std::FILE* file = std::fopen(path.c_str(), "w");
  Require(file != nullptr && chmod(path.c_str(), 0600) == 0 && write(file) == 1);
  std::fclose(file);
}

}  // namespace

CertificateMaker::CertificateMaker(std::string folder, const std::string& name)
    : folder_(std::move(folder)),
      key_(EVP_EC_gen("P-256"), &EVP_PKEY_free),
      certificate_(nullptr, &X509_free),
      revoked_(X509_CRL_new(), &X509_CRL_free) {
  certificate_ = Make(name, key_.get(), 30, "IP:127.0.0.1,DNS:localhost", -1);
  authority_ = Write(name, certificate_.get(), key_.get());
}

CertificateMaker::Certificate CertificateMaker::Make(const std::string& common_name, EVP_PKEY* key, int days,
                                                     const std::string& names, int from_days) {
  Certificate made(X509_new(), &X509_free);
  X509* issuer = certificate_ ? certificate_.get() : made.get();
  Require(X509_set_version(made.get(), X509_VERSION_3) == 1);
  ASN1_INTEGER_set(X509_get_serialNumber(made.get()), ++made_);
  X509_gmtime_adj(X509_getm_notBefore(made.get()), from_days * kDay_s);
  X509_gmtime_adj(X509_getm_notAfter(made.get()), (from_days + days) * kDay_s);
  X509_set_pubkey(made.get(), key);
  SetName(X509_get_subject_name(made.get()), common_name);
  X509_set_issuer_name(made.get(), X509_get_subject_name(issuer));
  AddExtension(made.get(), issuer, NID_basic_constraints,
               certificate_ ? "critical,CA:FALSE" : "critical,CA:TRUE");
  AddExtension(made.get(), issuer, NID_subject_alt_name, names.c_str());
  Require(X509_sign(made.get(), key_.get(), EVP_sha256()) > 0);
  return made;
}

CertificateFiles CertificateMaker::Write(const std::string& name, X509* certificate, EVP_PKEY* key) const {
  CertificateFiles files{absl::StrCat(folder_, "/", name, ".crt"), absl::StrCat(folder_, "/", name, ".key")};
  WritePem(files.certificate, [&](std::FILE* file) { return PEM_write_X509(file, certificate); });
  WritePem(files.key, [&](std::FILE* file) {
    return PEM_write_PrivateKey(file, key, nullptr, nullptr, 0, nullptr, nullptr);
  });
  return files;
}

CertificateFiles CertificateMaker::Sign(const std::string& common_name, int days, const std::string& names,
                                        int from_days) {
  const Key key(EVP_EC_gen("P-256"), &EVP_PKEY_free);
  const Certificate made = Make(common_name, key.get(), days, names, from_days);
  return Write(absl::StrCat(common_name, "-", made_), made.get(), key.get());
}

void CertificateMaker::Revoke(const CertificateFiles& certificate, const std::string& path) {
  std::FILE* file = std::fopen(certificate.certificate.c_str(), "r");
  Require(file != nullptr);
  const Certificate gone(PEM_read_X509(file, nullptr, nullptr, nullptr), &X509_free);
  std::fclose(file);
  X509_CRL* list = revoked_.get();
  X509_CRL_set_version(list, X509_CRL_VERSION_2);
  X509_CRL_set_issuer_name(list, X509_get_subject_name(certificate_.get()));
  ASN1_TIME* now = X509_gmtime_adj(nullptr, 0);
  ASN1_TIME* later = X509_gmtime_adj(nullptr, 30 * kDay_s);
  X509_CRL_set1_lastUpdate(list, now);
  X509_CRL_set1_nextUpdate(list, later);
  X509_REVOKED* entry = X509_REVOKED_new();
  X509_REVOKED_set_serialNumber(entry, X509_get_serialNumber(gone.get()));
  X509_REVOKED_set_revocationDate(entry, now);
  Require(X509_CRL_add0_revoked(list, entry) == 1 && X509_CRL_sort(list) == 1 &&
          X509_CRL_sign(list, key_.get(), EVP_sha256()) > 0);
  ASN1_TIME_free(now);
  ASN1_TIME_free(later);
  WritePem(path, [&](std::FILE* out) { return PEM_write_X509_CRL(out, list); });
}

}  // namespace weft
