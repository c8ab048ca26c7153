#include "services/server/access/role_words.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

TEST(RoleWords, AreThoseOfTheList) {
  for (const v1::Role role : {v1::ROLE_VIEWER, v1::ROLE_CLIENT, v1::ROLE_OPERATOR, v1::ROLE_ADMIN}) {
    const absl::StatusOr<v1::Role> read = ParseRole(RoleWord(role));
    ASSERT_TRUE(read.ok()) << RoleWord(role);
    EXPECT_EQ(*read, role);
  }
  EXPECT_STREQ(RoleWord(v1::ROLE_OPERATOR), "operator");
}

// "nobody" is what a list shows, and no role that anybody can have.
TEST(RoleWords, RefuseWhatIsNoRole) {
  EXPECT_STREQ(RoleWord(v1::ROLE_UNSPECIFIED), "nobody");
  for (const char* word : {"", "nobody", "Admin", "admin ", "root"}) {
    const absl::Status status = ParseRole(word).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << word;
  }
  EXPECT_EQ(ParseRole("root").status().message(), "role: \"root\" is not viewer, client, operator or admin");
}

}  // namespace
}  // namespace weft
