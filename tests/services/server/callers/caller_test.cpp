#include "services/server/callers/caller.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

TEST(CallerNames, CountTokensOfOneNameAsOneAccount) {
  EXPECT_EQ(AccountOf("token 0a1b2c3d4e5f (anna)"), "token anna");
  EXPECT_TRUE(IsSameAccount("token 0a1b2c3d4e5f (anna)", "token ffffffffffff (anna)"));
  EXPECT_FALSE(IsSameAccount("token 0a1b2c3d4e5f (anna)", "token 0a1b2c3d4e5f (bert)"));
}

TEST(CallerNames, OfOtherKindsAreAccountsByThemselves) {
  for (const char* name : {"certificate anna", "user weft", "token", "token anna", "token (anna)", ""})
    EXPECT_EQ(AccountOf(name), name);
  EXPECT_FALSE(IsSameAccount("certificate anna", "user anna"));
  EXPECT_TRUE(IsSameAccount("user weft", "user weft"));
}

// Where two are unknown, they need not be the same.
TEST(CallerNames, ThatNobodyKnowsAreNoAccount) {
  EXPECT_FALSE(IsSameAccount("", ""));
  EXPECT_FALSE(IsSameAccount("user weft", ""));
}

TEST(CallerNames, MayHoldBracketsThemselves) {
  EXPECT_EQ(AccountOf("token 0a1b2c3d4e5f (anna (night))"), "token anna (night)");
}

}  // namespace
}  // namespace weft
