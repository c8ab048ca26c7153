// Certificates as servers and clients show them.
#include "services/server/access/certificates.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <sys/stat.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <vector>

#include "services/formats/files/atomic_file.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/server/access/certificate_maker.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class Certificates : public ::testing::Test {
 protected:
  TempFolder folder_;
  CertificateMaker maker_{folder_.path(), "studio"};
  const CertificateFiles server_ = maker_.Sign("weftd");
};

TEST_F(Certificates, ServeWithTheirKey) {
  EXPECT_TRUE(CheckTlsFiles({server_.certificate, server_.key, "", ""}).ok());
  EXPECT_TRUE(CheckTlsFiles({server_.certificate, server_.key, maker_.authority(), ""}).ok());
}

TEST_F(Certificates, NameTheOptionThatIsWrong) {
  const CertificateFiles other = maker_.Sign("other");
  std::ofstream(folder_ / "text") << "no PEM";
  const std::string text = folder_ / "text", missing = folder_ / "missing";
  const struct {
    const char* option;
    TlsFiles files;
  } cases[] = {{"--tls-cert", {missing, server_.key, "", ""}},
               {"--tls-cert", {text, server_.key, "", ""}},
               {"--tls-key", {server_.certificate, missing, "", ""}},
               {"--tls-key", {server_.certificate, other.key, "", ""}},
               {"--tls-client-ca", {server_.certificate, server_.key, text, ""}},
               {"--tls-client-crl", {server_.certificate, server_.key, maker_.authority(), text}}};
  for (const auto& c : cases) EXPECT_THAT(std::string(CheckTlsFiles(c.files).message()), HasSubstr(c.option));
}

TEST_F(Certificates, DoNotServeWithAKeyThatOthersRead) {
  ASSERT_EQ(chmod(server_.key.c_str(), 0640), 0);
  const absl::Status status = CheckTlsFiles({server_.certificate, server_.key, "", ""});
  EXPECT_TRUE(absl::IsPermissionDenied(status));
  EXPECT_THAT(std::string(status.message()), HasSubstr("chmod"));
}

TEST_F(Certificates, DoNotServeAtATimeForWhichTheyAreNot) {
  const CertificateFiles old = maker_.Sign("old", 5, "DNS:localhost", -10);
  const absl::Status expired = CheckTlsFiles({old.certificate, old.key, "", ""});
  EXPECT_TRUE(absl::IsInvalidArgument(expired));
  EXPECT_THAT(std::string(expired.message()), HasSubstr("expired on"));
  const CertificateFiles coming = maker_.Sign("coming", 30, "DNS:localhost", 2);
  EXPECT_THAT(std::string(CheckTlsFiles({coming.certificate, coming.key, "", ""}).message()),
              HasSubstr("clock"));
}

TEST_F(Certificates, HaveTheNamesOfTheirServer) {
  const CertificateFiles named =
      maker_.Sign("named", 30, "DNS:vm.studio.example,IP:10.0.0.1,DNS:*.farm.example");
  EXPECT_THAT(NamesOfCertificate(named.certificate), ElementsAre("vm.studio.example", "*.farm.example"));
  EXPECT_THAT(NamesOfCertificate(folder_ / "missing"), IsEmpty());
}

class Revocations : public Certificates {
 protected:
  std::string Text(const CertificateFiles& files) { return ReadWholeFile(files.certificate).value(); }

  const std::string path_ = folder_ / "revoked.crl";
  std::vector<std::string> warnings_;
  RevocationList list_{path_, [this](const std::string& warning) { warnings_.push_back(warning); }};
};

TEST_F(Revocations, ReachCertificatesWhileTheListGrows) {
  const CertificateFiles anna = maker_.Sign("anna"), ben = maker_.Sign("ben");
  maker_.Revoke(maker_.Sign("somebody"), path_);
  EXPECT_FALSE(list_.IsRevoked(Text(anna)));
  maker_.Revoke(anna, path_);
  EXPECT_TRUE(list_.IsRevoked(Text(anna)));
  EXPECT_FALSE(list_.IsRevoked(Text(ben)));
  EXPECT_THAT(warnings_, IsEmpty());
}

TEST_F(Revocations, LeaveSerialNumbersOfOtherAuthoritiesAlone) {
  CertificateMaker other(folder_.path(), "other-studio");
  const CertificateFiles anna = other.Sign("anna");
  maker_.Revoke(server_, path_);  // the first that either authority signed
  EXPECT_TRUE(list_.IsRevoked(Text(server_)));
  EXPECT_FALSE(list_.IsRevoked(Text(anna)));
}

TEST_F(Revocations, KeepEverybodyOutWhileTheListCannotBeRead) {
  const CertificateFiles anna = maker_.Sign("anna");
  EXPECT_TRUE(list_.IsRevoked(Text(anna)));
  std::ofstream(path_) << "no PEM";
  EXPECT_TRUE(list_.IsRevoked(Text(anna)));
  EXPECT_THAT(warnings_, SizeIs(2));
  maker_.Revoke(server_, path_);
  EXPECT_FALSE(list_.IsRevoked(Text(anna)));
  EXPECT_TRUE(list_.IsRevoked("no certificate"));
}

TEST_F(Certificates, SayWhatIsWrongWithThem) {
  const auto error_of = [](const TlsFiles& files) { return std::string(CheckTlsFiles(files).message()); };
  const std::string text = folder_ / "text", locked = folder_ / "locked.key";
  WriteBytes(text, "no PEM");
  const std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)> key(EVP_EC_gen("P-256"), &EVP_PKEY_free);
  std::FILE* file = std::fopen(locked.c_str(), "w");
  ASSERT_NE(file, nullptr);
  char phrase[] = "phrase";
  EXPECT_EQ(PEM_write_PrivateKey(file, key.get(), EVP_aes_128_cbc(), nullptr, 0, nullptr, phrase), 1);
  std::fclose(file);
  ASSERT_EQ(chmod(locked.c_str(), 0600), 0);
  EXPECT_EQ(error_of({text, server_.key, "", ""}), "--tls-cert: " + text + ": no certificate in PEM");
  EXPECT_EQ(error_of({server_.certificate, locked, "", ""}),
            "--tls-key: " + locked + ": no private key without a passphrase in PEM");
  EXPECT_EQ(error_of({server_.certificate, maker_.Sign("other").key, "", ""}),
            "--tls-key: " + (folder_ / "other-3.key") + ": this is the key of another certificate");
  EXPECT_EQ(error_of({server_.certificate, server_.key, text, ""}),
            "--tls-client-ca: " + text + ": no certificate in PEM");
  EXPECT_EQ(error_of({server_.certificate, server_.key, "", text}),
            "--tls-client-crl: " + text + ": no revocation list in PEM");
  maker_.Revoke(server_, folder_ / "list.pem");
  EXPECT_EQ(error_of({server_.certificate, server_.key, maker_.authority(), folder_ / "list.pem"}), "");
  for (const mode_t mode : {0610, 0601, 0620}) {
    ASSERT_EQ(chmod(server_.key.c_str(), mode), 0);
    EXPECT_EQ(error_of({server_.certificate, server_.key, "", ""}),
              "--tls-key: " + server_.key + ": other users may read the key; close it by `chmod go-rwx " +
                  server_.key + "`");
  }
}

TEST_F(Certificates, SayWhenTheyAreValid) {
  const CertificateFiles old = maker_.Sign("old", 5, "DNS:localhost", -10);
  EXPECT_THAT(
      std::string(CheckTlsFiles({old.certificate, old.key, "", ""}).message()),
      ::testing::MatchesRegex("--tls-cert: .*: the certificate expired on [A-Z][a-z][a-z] .* GMT; renew it"));
  const CertificateFiles coming = maker_.Sign("coming", 30, "DNS:localhost", 2);
  EXPECT_THAT(std::string(CheckTlsFiles({coming.certificate, coming.key, "", ""}).message()),
              ::testing::MatchesRegex(
                  "--tls-cert: .*: the certificate is valid from [A-Z][a-z][a-z] .* GMT on; is this "
                  "machine's clock right."));
}

TEST_F(Revocations, AreToldOnceForEachStateOfTheList) {
  const CertificateFiles anna = maker_.Sign("anna");
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(list_.IsRevoked(Text(anna)));
  std::ofstream(path_) << "no PEM";
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(list_.IsRevoked(Text(anna)));
  ASSERT_THAT(warnings_, SizeIs(2));
  EXPECT_THAT(warnings_[0], ::testing::EndsWith("; no certificate is accepted until then"));
  EXPECT_EQ(warnings_[1], path_ + ": no revocation list in PEM; no certificate is accepted until then");
}

}  // namespace
}  // namespace weft
