// Tokens and certificates on the disk.
#include "services/server/access/access_list.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <fstream>
#include <set>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/host_clock.h"
#include "services/formats/files/atomic_file.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::MatchesRegex;
using ::testing::Not;
using ::testing::SizeIs;

class AccessOnDisk : public ::testing::Test {
 protected:
  TempFolder folder_;
  const std::string path_ = AccessListFile(folder_.path());
};

TEST_F(AccessOnDisk, KeepsHashesOfTokensAlone) {
  const NewToken added = AddToken(path_, {"anna", v1::ROLE_OPERATOR}).value();
  EXPECT_THAT(added.text, MatchesRegex("weft_[0-9a-f]{64}"));
  const std::string text = ReadWholeFile(path_).value();
  EXPECT_THAT(text, Not(HasSubstr(added.text.substr(5, 20))));
  const v1::AccessList list = ReadAccessList(path_).value();
  ASSERT_THAT(list.tokens(), SizeIs(1));
  EXPECT_EQ(list.tokens(0).sha256(), HashOfToken(added.text));
  EXPECT_EQ(list.tokens(0).name(), "anna");
  EXPECT_EQ(list.tokens(0).role(), v1::ROLE_OPERATOR);
  EXPECT_EQ(list.tokens(0).expires_unix_ns(), 0);
}

// FIPS 180-2, appendix B.1.
TEST_F(AccessOnDisk, HashesAsOtherProgramsDo) {
  EXPECT_EQ(HashOfToken("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST_F(AccessOnDisk, IsClosedToOtherUsers) {
  ASSERT_TRUE(AddToken(path_, {"anna", v1::ROLE_VIEWER}).ok());
  struct stat file = {};
  ASSERT_EQ(stat(path_.c_str(), &file), 0);
  EXPECT_EQ(file.st_mode & 0777, 0600U);
}

TEST_F(AccessOnDisk, IsNotReadWhereOthersMayWriteIt) {
  ASSERT_TRUE(AddToken(path_, {"anna", v1::ROLE_VIEWER}).ok());
  ASSERT_EQ(chmod(path_.c_str(), 0620), 0);
  const absl::Status status = ReadAccessList(path_).status();
  EXPECT_TRUE(absl::IsPermissionDenied(status));
  EXPECT_THAT(std::string(status.message()), HasSubstr("chmod go-rwx"));
}

TEST_F(AccessOnDisk, RevokesByIdAndByName) {
  const NewToken first = AddToken(path_, {"anna", v1::ROLE_VIEWER}).value();
  const NewToken second = AddToken(path_, {"anna", v1::ROLE_ADMIN}).value();
  ASSERT_TRUE(AllowCertificate(path_, "render-1", v1::ROLE_CLIENT).ok());
  ASSERT_TRUE(RevokeAccess(path_, first.token.id()).ok());
  ASSERT_TRUE(RevokeAccess(path_, "render-1").ok());
  const v1::AccessList list = ReadAccessList(path_).value();
  ASSERT_THAT(list.tokens(), SizeIs(1));
  EXPECT_EQ(list.tokens(0).id(), second.token.id());
  EXPECT_THAT(list.certificates(), IsEmpty());
  EXPECT_TRUE(absl::IsNotFound(RevokeAccess(path_, first.token.id())));
}

TEST_F(AccessOnDisk, GivesACertificateOneRole) {
  ASSERT_TRUE(AllowCertificate(path_, "render-1", v1::ROLE_CLIENT).ok());
  ASSERT_TRUE(AllowCertificate(path_, "render-1", v1::ROLE_VIEWER).ok());
  const v1::AccessList list = ReadAccessList(path_).value();
  ASSERT_THAT(list.certificates(), SizeIs(1));
  EXPECT_EQ(list.certificates(0).role(), v1::ROLE_VIEWER);
}

TEST_F(AccessOnDisk, RefusesWhatIsNoRequest) {
  EXPECT_TRUE(absl::IsInvalidArgument(AddToken(path_, {"", v1::ROLE_VIEWER}).status()));
  EXPECT_TRUE(absl::IsInvalidArgument(AddToken(path_, {"a\nb", v1::ROLE_VIEWER}).status()));
  EXPECT_TRUE(absl::IsInvalidArgument(AddToken(path_, {"anna"}).status()));
  EXPECT_TRUE(absl::IsInvalidArgument(AddToken(path_, {"anna", v1::ROLE_VIEWER, -1}).status()));
  EXPECT_TRUE(absl::IsInvalidArgument(AddToken(path_, {"anna", v1::ROLE_VIEWER, 1e300}).status()));
  EXPECT_TRUE(absl::IsInvalidArgument(AllowCertificate(path_, "", v1::ROLE_VIEWER)));
  EXPECT_TRUE(absl::IsInvalidArgument(AllowCertificate(path_, "render-1", static_cast<v1::Role>(99))));
  EXPECT_THAT(ReadAccessList(path_).value().tokens(), IsEmpty());
}

TEST_F(AccessOnDisk, LeavesADamagedListAlone) {
  std::ofstream(path_) << R"({"tokens": [{"nam)";
  ASSERT_EQ(chmod(path_.c_str(), 0600), 0);
  const absl::Status status = AddToken(path_, {"anna", v1::ROLE_VIEWER}).status();
  EXPECT_TRUE(absl::IsInvalidArgument(status));
  EXPECT_THAT(std::string(status.message()), HasSubstr(path_));
  EXPECT_EQ(ReadWholeFile(path_).value(), R"({"tokens": [{"nam)");
}

TEST_F(AccessOnDisk, LosesNothingOfChangesAtOnce) {
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i)
    threads.emplace_back([&, i] {
      EXPECT_TRUE(AddToken(path_, {absl::StrCat("client", i), v1::ROLE_CLIENT}).ok());
    });
  for (std::thread& thread : threads) thread.join();
  std::set<std::string> hashes;
  const v1::AccessList list = ReadAccessList(path_).value();
  for (const v1::Token& token : list.tokens()) hashes.insert(token.sha256());
  EXPECT_THAT(hashes, SizeIs(8));
}

TEST_F(AccessOnDisk, RequestsHaveLimits) {
  const int64_t before_ns = HostTime_ns();
  const NewToken longest = AddToken(path_, {"anna", v1::ROLE_VIEWER, 36500}).value();
  EXPECT_EQ(longest.token.id(), HashOfToken(longest.text).substr(0, 12));
  EXPECT_GE(longest.token.created_unix_ns(), before_ns);
  const int64_t days_ns = int64_t{36500} * 86400 * 1'000'000'000;
  EXPECT_GE(longest.token.expires_unix_ns(), before_ns + days_ns);
  EXPECT_LE(longest.token.expires_unix_ns(), HostTime_ns() + days_ns);
  EXPECT_EQ(ReadAccessList(path_)->tokens(0).DebugString(), longest.token.DebugString());
  for (const double days : {36500.1, -0.1, static_cast<double>(NAN)})
    EXPECT_EQ(AddToken(path_, {"anna", v1::ROLE_VIEWER, days}).status(),
              absl::InvalidArgumentError("days: must be 0 to 36500"));
  EXPECT_TRUE(AllowCertificate(path_, std::string(64, 'n'), v1::ROLE_VIEWER).ok());
  for (const std::string& name : {std::string(), std::string(65, 'n')})
    EXPECT_EQ(AllowCertificate(path_, name, v1::ROLE_VIEWER),
              absl::InvalidArgumentError("common name: must have 1 to 64 characters"));
  EXPECT_EQ(AllowCertificate(path_, "n", v1::ROLE_UNSPECIFIED),
            absl::InvalidArgumentError("role: must be viewer, client, operator or admin"));
}

TEST_F(AccessOnDisk, SaysWhatItDoesNotFindOrRead) {
  EXPECT_EQ(RevokeAccess(path_, "x"),
            absl::NotFoundError(absl::StrCat(path_,
                                             ": no token of id \"x\" and no certificate of that name; `weft "
                                             "access list` shows them")));
  ASSERT_TRUE(AllowCertificate(path_, "a", v1::ROLE_CLIENT).ok());
  ASSERT_TRUE(AllowCertificate(path_, "b", v1::ROLE_VIEWER).ok());
  ASSERT_TRUE(AllowCertificate(path_, "b", v1::ROLE_ADMIN).ok());
  EXPECT_EQ(ReadAccessList(path_)->ShortDebugString(),
            "certificates { common_name: \"a\" role: ROLE_CLIENT } certificates { common_name: \"b\" role: "
            "ROLE_ADMIN }");
  for (const mode_t mode : {0620, 0602}) {
    ASSERT_EQ(chmod(path_.c_str(), mode), 0);
    EXPECT_EQ(ReadAccessList(path_).status(),
              absl::PermissionDeniedError(absl::StrCat(
                  path_, ": other users may write this file; close it by `chmod go-rwx ", path_, "`")));
  }
  ASSERT_EQ(chmod(path_.c_str(), 0644), 0);
  EXPECT_TRUE(ReadAccessList(path_).ok());
  EXPECT_FALSE(ReadAccessList(path_ + "/below-a-file").ok());
  EXPECT_EQ(AccessListFile("/state"), "/state/access.json");
}

}  // namespace
}  // namespace weft
