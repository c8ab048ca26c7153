#include "services/server/access/certificate_life.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ctime>

#include "tests/capture/temp_folder.h"
#include "tests/services/server/access/certificate_maker.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

constexpr int64_t kCertificateDay_s = 24 * 3600;

TEST(CertificateLife, IsThatOfTheCertificate) {
  const TempFolder folder;
  CertificateMaker maker(folder.path(), "studio");
  const int64_t begin_s = std::time(nullptr);
  const auto lives = LivesOfCertificates(maker.Sign("weftd", 30).certificate);
  ASSERT_TRUE(lives.ok()) << lives.status();
  ASSERT_EQ(lives->size(), 1u);
  EXPECT_THAT(lives->front().subject, HasSubstr("weftd"));
  EXPECT_NEAR(static_cast<double>(lives->front().ends_unix_s),
              static_cast<double>(begin_s + 30 * kCertificateDay_s), 2 * kCertificateDay_s);
}

TEST(CertificateLife, IsThatOfAllInAFile) {
  const TempFolder folder;
  CertificateMaker maker(folder.path(), "studio");
  const CertificateFiles first = maker.Sign("first", 10), second = maker.Sign("second", 400);
  maker.Revoke(first, folder / "list.pem");
  WriteBytes(folder / "all.pem",
             ReadBytes(first.certificate) + ReadBytes(second.certificate) + ReadBytes(folder / "list.pem"));
  const auto lives = LivesOfCertificates(folder / "all.pem");
  ASSERT_TRUE(lives.ok()) << lives.status();
  ASSERT_EQ(lives->size(), 3u);
  EXPECT_THAT((*lives)[0].subject, HasSubstr("first"));
  EXPECT_THAT((*lives)[1].subject, HasSubstr("second"));
  EXPECT_NEAR(static_cast<double>((*lives)[1].ends_unix_s - (*lives)[0].ends_unix_s),
              390.0 * kCertificateDay_s, kCertificateDay_s);
  EXPECT_THAT((*lives)[2].subject, HasSubstr("revocation list of "));
  EXPECT_THAT((*lives)[2].subject, HasSubstr("studio"));
}

TEST(CertificateLife, OfAFileWithoutCertificateIsAnError) {
  const TempFolder folder;
  WriteBytes(folder / "text", "no PEM");
  EXPECT_EQ(LivesOfCertificates(folder / "text").status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(LivesOfCertificates(folder / "missing").status().code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace weft
