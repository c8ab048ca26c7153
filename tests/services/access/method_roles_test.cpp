// What the schemas say about roles.
#include "services/access/method_roles.h"

#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"
#include "services/access/role_words.h"
#include "weft/v1/jobs.pb.h"
#include "weft/v1/takes.pb.h"

namespace weft {
namespace {

TEST(RoleOfMethod, IsWhatTheSchemaSays) {
  EXPECT_EQ(RoleOfMethod("/weft.v1.Jobs/ListJobs"), v1::ROLE_VIEWER);
  EXPECT_EQ(RoleOfMethod("/weft.v1.Jobs/SubmitJob"), v1::ROLE_CLIENT);
  EXPECT_EQ(RoleOfMethod("/weft.v1.Takes/StartTake"), v1::ROLE_OPERATOR);
  EXPECT_EQ(RoleOfMethod("/weft.v1.Takes/EmptyTrash"), v1::ROLE_ADMIN);
}

TEST(RoleOfMethod, LetsEverybodyAskForHealth) {
  EXPECT_EQ(RoleOfMethod("/grpc.health.v1.Health/Check"), v1::ROLE_UNSPECIFIED);
  EXPECT_EQ(RoleOfMethod("/grpc.health.v1.Health/Watch"), v1::ROLE_UNSPECIFIED);
}

TEST(RoleOfMethod, KeepsWhatNoSchemaKnowsFromStrangers) {
  for (const char* path :
       {"/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", "/a.b/c", "", "/"})
    EXPECT_EQ(RoleOfMethod(path), v1::ROLE_VIEWER) << path;
}

TEST(RoleOfMethod, ReadsNoPathAsAnother) {
  for (const char* path : {"weft.v1.Takes/StartTake", "//weft.v1.Takes/StartTake", "/weft.v1.Takes.StartTake",
                           "/weft/v1/Takes/StartTake", "/grpc.health.v1.Health"})
    EXPECT_GE(RoleOfMethod(path), v1::ROLE_VIEWER) << path;
}

TEST(RoleWords, AreReadAsTheyAreWritten) {
  for (const v1::Role role : {v1::ROLE_VIEWER, v1::ROLE_CLIENT, v1::ROLE_OPERATOR, v1::ROLE_ADMIN})
    EXPECT_EQ(ParseRole(RoleWord(role)).value(), role);
  EXPECT_TRUE(absl::IsInvalidArgument(ParseRole("nobody").status()));
  EXPECT_TRUE(absl::IsInvalidArgument(ParseRole("").status()));
}

}  // namespace
}  // namespace weft
