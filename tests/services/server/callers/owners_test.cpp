// Whose things are whose.
#include "services/server/callers/owners.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace weft {
namespace {

using ::testing::HasSubstr;

TEST(OwnersTest, AccountsAreNamesOfTokens) {
  EXPECT_EQ(AccountOf("token 0a1b2c3d4e5f (anna)"), "token anna");
  EXPECT_EQ(AccountOf("token 0a1b2c3d4e5f (anna (stage 2))"), "token anna (stage 2)");
  EXPECT_EQ(AccountOf("certificate anna"), "certificate anna");
  EXPECT_EQ(AccountOf("user weft"), "user weft");
  EXPECT_EQ(AccountOf("token"), "token");
  EXPECT_EQ(AccountOf(""), "");
}

TEST(OwnersTest, NobodyIsNotTheSameAsNobody) {
  EXPECT_TRUE(IsSameAccount("token 1 (anna)", "token 2 (anna)"));
  EXPECT_FALSE(IsSameAccount("token 1 (anna)", "certificate anna"));
  EXPECT_FALSE(IsSameAccount("", ""));
}

TEST(OwnersTest, OwnersAndOperatorsMayChange) {
  const Caller anna{"token 2 (anna)", v1::ROLE_CLIENT}, ben{"token 3 (ben)", v1::ROLE_CLIENT};
  const std::string owner = "token 1 (anna)";
  EXPECT_TRUE(CheckMayChange(anna, "job_id", "job 7", owner).ok());
  const absl::Status refused = CheckMayChange(ben, "job_id", "job 7", owner);
  EXPECT_TRUE(absl::IsPermissionDenied(refused));
  EXPECT_EQ(refused.message(), "job_id: job 7 belongs to token 1 (anna); ask its owner or an operator");
  for (const v1::Role role : {v1::ROLE_OPERATOR, v1::ROLE_ADMIN})
    EXPECT_TRUE(CheckMayChange({"certificate stage", role}, "job_id", "job 7", owner).ok());
  const absl::Status unknown = CheckMayChange(ben, "job_id", "job 7", "");
  EXPECT_THAT(std::string(unknown.message()), HasSubstr("nobody knows whose job 7 is; ask an operator"));
}

TEST(OwnersTest, RequestsAreRepeatedByWhoMadeThem) {
  const Caller anna{"token 2 (anna)", v1::ROLE_CLIENT}, stage{"token 3 (stage)", v1::ROLE_OPERATOR};
  const std::string owner = "token 1 (anna)";
  EXPECT_TRUE(CheckRepeats(anna, owner, true, "job 7 was submitted").ok());
  const absl::Status other = CheckRepeats(anna, owner, false, "job 7 was submitted");
  EXPECT_TRUE(absl::IsAlreadyExists(other));
  EXPECT_EQ(other.message(), "idempotency_key: job 7 was submitted with another request; choose a new key");
  for (const bool asks_for_the_same : {true, false}) {
    const absl::Status theirs = CheckRepeats(stage, owner, asks_for_the_same, "job 7 was submitted");
    EXPECT_TRUE(absl::IsAlreadyExists(theirs));
    EXPECT_EQ(theirs.message(), "idempotency_key: stands for a request of somebody else; choose a new key");
  }
}

TEST(OwnersTest, HighPrioritiesAreForOperators) {
  const Caller client{"token 1 (anna)", v1::ROLE_CLIENT}, user{"user weft", v1::ROLE_ADMIN};
  EXPECT_EQ(PriorityFor(client, 100), 10);
  EXPECT_EQ(PriorityFor(client, 11), 10);
  EXPECT_EQ(PriorityFor(client, 10), 10);
  EXPECT_EQ(PriorityFor(client, -5), -5);
  EXPECT_EQ(PriorityFor(user, 100), 100);
  EXPECT_EQ(PriorityClass(-10), PriorityClass(10));
  EXPECT_LT(PriorityClass(10), PriorityClass(11));
  EXPECT_LT(PriorityClass(-11), PriorityClass(-10));
}

}  // namespace
}  // namespace weft
