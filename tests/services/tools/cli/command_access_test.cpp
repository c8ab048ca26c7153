// weft access token, certificate, revoke, list, log.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "services/formats/files/json_file.h"
#include "services/server/access/access_list.h"
#include "services/server/access/audit_log.h"
#include "services/tools/cli/commands.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/tools/cli/run_command.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;

class CommandAccess : public ::testing::Test {
 protected:
  CommandRun Access(std::vector<std::string> words) const {
    words.insert(words.begin(), "access");
    words.insert(words.end(), {"--state", state_.path()});
    return RunCommand(AddAccessCommand, std::move(words));
  }
  v1::AccessList List() const {
    const auto list = ReadAccessList(AccessListFile(state_.path()));
    EXPECT_TRUE(list.ok()) << list.status();
    return list.ok() ? *list : v1::AccessList();
  }

  const TempFolder state_;
};

TEST_F(CommandAccess, ATokenIsPrintedOnceAndItsHashAloneIsKept) {
  const CommandRun run = Access({"token", "anna", "--role", "operator"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  ASSERT_EQ(List().tokens_size(), 1);
  EXPECT_EQ(List().tokens(0).name(), "anna");
  EXPECT_EQ(List().tokens(0).role(), v1::ROLE_OPERATOR);
  EXPECT_EQ(List().tokens(0).expires_unix_ns(), 0);
  ASSERT_FALSE(run.out.empty());
  const std::string text = run.out.substr(0, run.out.size() - 1);  // without its line break
  EXPECT_EQ(HashOfToken(text), List().tokens(0).sha256());
  EXPECT_EQ(ReadBytes(AccessListFile(state_.path())).find(text), std::string::npos);
}

TEST_F(CommandAccess, ListsTokensAndCertificatesWithTheirRoles) {
  EXPECT_EQ(Access({"list"}).out,
            "no tokens and no certificates: the daemon knows its own user and root alone\n");
  ASSERT_TRUE(Access({"token", "anna", "--role", "viewer"}).status.ok());
  ASSERT_TRUE(Access({"certificate", "render-1", "--role", "client"}).status.ok());
  const CommandRun run = Access({"list"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(run.out, MatchesRegex("token +anna +viewer +id [0-9a-f]+, made [0-9-]+, expires never\n"
                                    "certificate +render-1 +client *\n"));
  ASSERT_TRUE(Access({"certificate", "render-1", "--role", "admin"}).status.ok());
  ASSERT_EQ(List().certificates_size(), 1);
  EXPECT_EQ(List().certificates(0).role(), v1::ROLE_ADMIN);
}

TEST_F(CommandAccess, ATokenExpiresAfterItsDays) {
  ASSERT_TRUE(Access({"token", "anna", "--role", "viewer", "--days", "90"}).status.ok());
  const v1::Token token = List().tokens(0);
  constexpr int64_t kDay_ns = 24LL * 3600 * 1'000'000'000;
  // To the minute: the clock is read twice.
  EXPECT_NEAR(static_cast<double>(token.expires_unix_ns() - token.created_unix_ns()), 90.0 * kDay_ns, 60e9);
}

TEST_F(CommandAccess, WhatIsRevokedIsNoLongerKnown) {
  ASSERT_TRUE(Access({"token", "anna", "--role", "viewer"}).status.ok());
  ASSERT_TRUE(Access({"certificate", "render-1", "--role", "client"}).status.ok());
  ASSERT_TRUE(Access({"revoke", List().tokens(0).id()}).status.ok());
  EXPECT_EQ(List().tokens_size(), 0);
  ASSERT_TRUE(Access({"revoke", "render-1"}).status.ok());
  EXPECT_EQ(List().certificates_size(), 0);
  EXPECT_EQ(Access({"revoke", "render-1"}).status.code(), absl::StatusCode::kNotFound);
}

TEST_F(CommandAccess, TheLogShowsItsLastEntriesInWords) {
  EXPECT_EQ(Access({"log"}).out, "");
  {
    auto log = AuditLog::Open(AuditLogFile(state_.path()), nullptr);
    ASSERT_TRUE(log.ok()) << log.status();
    v1::AuditEntry entry;
    entry.set_caller("anna");
    entry.set_peer("10.0.0.7");
    entry.set_method("StartTake");
    entry.set_outcome("OK");
    (*entry.mutable_about())["take"] = "walk";
    (*log)->Record(entry);
    v1::AuditEntry refused;
    refused.set_peer("10.0.0.8");
    refused.set_outcome("UNAUTHENTICATED");
    refused.set_message("no token");
    (*log)->Record(refused);
  }
  const CommandRun all = Access({"log"});
  ASSERT_TRUE(all.status.ok()) << all.status;
  EXPECT_THAT(all.out, HasSubstr("anna from 10.0.0.7  StartTake  take=walk\n"));
  EXPECT_THAT(all.out, HasSubstr("nobody known from 10.0.0.8  connections: no token\n"));
  const CommandRun last = Access({"log", "--last", "1"});
  EXPECT_EQ(last.out.find("anna"), std::string::npos);
  EXPECT_THAT(last.out, HasSubstr("10.0.0.8"));
}

TEST_F(CommandAccess, ALineOfTheLogHasWhoWhatHowOftenAndWhy) {
  {
    auto log = AuditLog::Open(AuditLogFile(state_.path()), nullptr);
    ASSERT_TRUE(log.ok()) << log.status();
    v1::AuditEntry entry;
    entry.set_caller("uid 1000");
    entry.set_peer("uid 1000");
    entry.set_method("DeleteTake");
    entry.set_outcome("PERMISSION_DENIED");
    entry.set_message("viewers look");
    entry.set_times(3);
    (*entry.mutable_about())["take"] = "walk";
    (*entry.mutable_about())["because"] = "old";
    (*log)->Record(entry);
    entry.set_times(1);
    for (int i = 0; i < 55; ++i) (*log)->Record(entry);
  }
  const std::string all = Access({"log", "--last", "1000"}).out, last = Access({"log"}).out;
  EXPECT_THAT(
      all.substr(0, all.find('\n')),
      MatchesRegex(
          "[0-9TZ:.-]+  PERMISSION_DENIED    uid 1000  DeleteTake \\(3 times\\)  because=old  take=walk: "
          "viewers look"));
  EXPECT_THAT(all, ::testing::EndsWith("uid 1000  DeleteTake  because=old  take=walk: viewers look\n"));
  EXPECT_EQ(std::count(all.begin(), all.end(), '\n'), 56);
  EXPECT_EQ(std::count(last.begin(), last.end(), '\n'), 50);
}

TEST_F(CommandAccess, TellsWhoseATokenIsAndUntilWhen) {
  const CommandRun run = Access({"token", "anna", "--role", "viewer", "--days", "1"});
  EXPECT_THAT(run.err, MatchesRegex("token [0-9a-f]+ of anna, viewer; it is shown this once:\n"));
  EXPECT_THAT(Access({"list"}).out,
              MatchesRegex(".*, made ([0-9]+-[0-9]+-[0-9]+), expires [0-9]+-[0-9]+-[0-9]+\n"));
  v1::AccessList list;
  ASSERT_TRUE(ParseJson(Access({"list", "--json"}).out, "list", list).ok());
  ASSERT_EQ(list.tokens_size(), 1);
  EXPECT_EQ(list.tokens(0).name(), "anna");
}

TEST_F(CommandAccess, RolesAndFoldersThatAreNoneAreRefused) {
  EXPECT_THAT(Access({"token", "anna", "--role", "king"}).message(),
              HasSubstr("viewer, client, operator, admin"));
  EXPECT_FALSE(Access({"token", "anna"}).status.ok());
  EXPECT_FALSE(RunCommand(AddAccessCommand, {"access", "list", "--state", state_ / "none"}).status.ok());
  EXPECT_EQ(List().tokens_size(), 0);
}

}  // namespace
}  // namespace weft
