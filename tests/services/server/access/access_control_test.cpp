// Who is known, and for how long.
#include "services/server/access/access_control.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <vector>

#include "base/host_clock.h"
#include "services/server/access/access_list.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr int64_t kSecond_ns = 1'000'000'000;

class Access : public ::testing::Test {
 protected:
  Access()
      : control_(
            path_, [this](const std::string& warning) { warnings_.push_back(warning); },
            [this] { return now_ns_; }) {}

  // The daemon looks at the list at most twice a second.
  absl::StatusOr<Caller> IdentifyLater(const Credentials& credentials) {
    now_ns_ += kSecond_ns;
    return control_.Identify(credentials);
  }

  TempFolder folder_;
  const std::string path_ = AccessListFile(folder_.path());
  int64_t now_ns_ = HostTime_ns();
  std::vector<std::string> warnings_;
  AccessControl control_;
};

TEST_F(Access, KnowsTheUserOfTheDaemonWithoutAList) {
  const Caller caller = control_.Identify({"weft", "", ""}).value();
  EXPECT_EQ(caller.name, "user weft");
  EXPECT_EQ(caller.role, v1::ROLE_ADMIN);
  EXPECT_TRUE(absl::IsUnauthenticated(control_.Identify({}).status()));
}

TEST_F(Access, KnowsTokensAsLongAsTheyAreListed) {
  const NewToken added = AddToken(path_, {"anna", v1::ROLE_CLIENT}).value();
  const Caller caller = IdentifyLater({"", added.text, ""}).value();
  EXPECT_EQ(caller.name, "token " + added.token.id() + " (anna)");
  EXPECT_EQ(caller.role, v1::ROLE_CLIENT);
  ASSERT_TRUE(RevokeAccess(path_, added.token.id()).ok());
  const absl::Status status = IdentifyLater({"", added.text, ""}).status();
  EXPECT_TRUE(absl::IsUnauthenticated(status));
  EXPECT_THAT(std::string(status.message()), HasSubstr("weft access token"));
}

TEST_F(Access, KnowsNewTokensWithoutARestart) {
  EXPECT_TRUE(absl::IsUnauthenticated(control_.Identify({}).status()));
  const NewToken added = AddToken(path_, {"anna", v1::ROLE_CLIENT}).value();
  EXPECT_TRUE(IdentifyLater({"", added.text, ""}).ok());
}

TEST_F(Access, ForgetsTokensThatExpire) {
  const NewToken added = AddToken(path_, {"anna", v1::ROLE_CLIENT, 1}).value();
  EXPECT_TRUE(IdentifyLater({"", added.text, ""}).ok());
  now_ns_ += 86400 * kSecond_ns;
  const absl::Status status = control_.Identify({"", added.text, ""}).status();
  EXPECT_TRUE(absl::IsUnauthenticated(status));
  EXPECT_THAT(std::string(status.message()), HasSubstr("(anna) expired at 2"));
}

// Whoever shows a token wants to be its owner, and learns when that fails.
TEST_F(Access, TakesAWrongTokenForNobody) {
  ASSERT_TRUE(AllowCertificate(path_, "render-1", v1::ROLE_CLIENT).ok());
  for (const char* token :
       {"weft_0", "x", "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"})
    EXPECT_TRUE(absl::IsUnauthenticated(IdentifyLater({"weft", token, "render-1"}).status())) << token;
}

// Who reads the list has no token.
TEST_F(Access, TakesAHashForNoToken) {
  const NewToken added = AddToken(path_, {"anna", v1::ROLE_CLIENT}).value();
  EXPECT_TRUE(absl::IsUnauthenticated(IdentifyLater({"", added.token.sha256(), ""}).status()));
}

TEST_F(Access, KnowsOwnersOfCertificatesThatHaveARole) {
  ASSERT_TRUE(AllowCertificate(path_, "render-1", v1::ROLE_OPERATOR).ok());
  const Caller caller = IdentifyLater({"", "", "render-1"}).value();
  EXPECT_EQ(caller.name, "certificate render-1");
  EXPECT_EQ(caller.role, v1::ROLE_OPERATOR);
  EXPECT_TRUE(absl::IsUnauthenticated(control_.Identify({"", "", "render-2"}).status()));
}

TEST_F(Access, KeepsTokensOutWhileTheListCannotBeRead) {
  const NewToken added = AddToken(path_, {"anna", v1::ROLE_CLIENT}).value();
  ASSERT_TRUE(IdentifyLater({"", added.text, ""}).ok());
  ASSERT_EQ(chmod(path_.c_str(), 0666), 0);
  EXPECT_TRUE(absl::IsUnauthenticated(IdentifyLater({"", added.text, ""}).status()));
  EXPECT_TRUE(absl::IsUnauthenticated(IdentifyLater({"", added.text, ""}).status()));
  EXPECT_THAT(warnings_, SizeIs(1));
  EXPECT_TRUE(IdentifyLater({"weft", "", ""}).ok());
  ASSERT_EQ(chmod(path_.c_str(), 0600), 0);
  EXPECT_TRUE(IdentifyLater({"", added.text, ""}).ok());
  EXPECT_THAT(warnings_, SizeIs(1));
}

TEST_F(Access, ComparesRoles) {
  EXPECT_TRUE(CheckMayCall({"a", v1::ROLE_OPERATOR}, "/weft.v1.Takes/StartTake").ok());
  EXPECT_TRUE(CheckMayCall({"a", v1::ROLE_ADMIN}, "/weft.v1.Jobs/ListJobs").ok());
  const absl::Status status = CheckMayCall({"token 1 (anna)", v1::ROLE_CLIENT}, "/weft.v1.Takes/StartTake");
  EXPECT_TRUE(absl::IsPermissionDenied(status));
  EXPECT_EQ(status.message(),
            "/weft.v1.Takes/StartTake asks for the role operator; token 1 (anna) has the role client");
}

TEST_F(Access, SaysWhyItKnowsSomebodyNot) {
  const std::string remedy = "; ask the daemon's administrator for a token (`weft access token`)";
  EXPECT_EQ(control_.Identify({}).status(),
            absl::UnauthenticatedError("this daemon asks for a token or a certificate" + remedy));
  EXPECT_EQ(control_.Identify({"", "x", ""}).status(),
            absl::UnauthenticatedError("this token is unknown or was revoked" + remedy));
  EXPECT_EQ(control_.Identify({"", "", "x"}).status(),
            absl::UnauthenticatedError("the owner of this certificate has no role here" + remedy));
}

TEST_F(Access, KnowsTokensByTheHashThatSomebodyKept) {
  const NewToken added = AddToken(path_, {"anna", v1::ROLE_VIEWER, 1}).value();
  EXPECT_EQ(control_.Identify({.token_sha256 = added.token.sha256()})->name,
            "token " + added.token.id() + " (anna)");
  EXPECT_FALSE(control_.Identify({.token_sha256 = std::string(64, 'a')}).ok());
  now_ns_ = added.token.expires_unix_ns() - 1;
  EXPECT_TRUE(control_.Identify({.token_sha256 = added.token.sha256()}).ok());
  ++now_ns_;
  EXPECT_FALSE(control_.Identify({.token_sha256 = added.token.sha256()}).ok());
}

TEST_F(Access, LooksAtItsListTwiceASecond) {
  EXPECT_FALSE(control_.Identify({}).ok());
  const NewToken added = AddToken(path_, {"anna", v1::ROLE_VIEWER}).value();
  now_ns_ += kSecond_ns / 2 - 1;
  EXPECT_FALSE(control_.Identify({"", added.text, ""}).ok());
  ++now_ns_;
  EXPECT_TRUE(control_.Identify({"", added.text, ""}).ok());
  ASSERT_TRUE(RevokeAccess(path_, added.token.id()).ok());
  now_ns_ -= 10 * kSecond_ns;  // the clock was set back
  EXPECT_FALSE(control_.Identify({"", added.text, ""}).ok());
  ASSERT_EQ(chmod(path_.c_str(), 0666), 0);
  EXPECT_FALSE(IdentifyLater({"", added.text, ""}).ok());
  EXPECT_THAT(warnings_,
              ::testing::ElementsAre(path_ + ": other users may write this file; close it by `chmod go-rwx " +
                                     path_ + "`; no token or certificate is accepted until then"));
}

}  // namespace
}  // namespace weft
