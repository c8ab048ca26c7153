// What the schemas say about roles.
#include "services/server/access/methods.h"

#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"
#include "services/server/access/role_words.h"
#include "weft/v1/jobs.pb.h"
#include "weft/v1/takes.pb.h"

namespace weft {
namespace {

TEST(MethodOf, IsWhatTheSchemaSays) {
  EXPECT_EQ(MethodOf("/weft.v1.Jobs/ListJobs").role, v1::ROLE_VIEWER);
  EXPECT_EQ(MethodOf("/weft.v1.Jobs/SubmitJob").role, v1::ROLE_CLIENT);
  EXPECT_EQ(MethodOf("/weft.v1.Takes/StartTake").role, v1::ROLE_OPERATOR);
  EXPECT_EQ(MethodOf("/weft.v1.Takes/EmptyTrash").role, v1::ROLE_ADMIN);
}

TEST(MethodOf, LetsEverybodyAskForHealth) {
  EXPECT_EQ(MethodOf("/grpc.health.v1.Health/Check").role, v1::ROLE_UNSPECIFIED);
  EXPECT_EQ(MethodOf("/grpc.health.v1.Health/Watch").role, v1::ROLE_UNSPECIFIED);
}

TEST(MethodOf, KeepsWhatNoSchemaKnowsFromStrangers) {
  for (const char* path :
       {"/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", "/a.b/c", "", "/"})
    EXPECT_EQ(MethodOf(path).role, v1::ROLE_VIEWER) << path;
}

TEST(MethodOf, ReadsNoPathAsAnother) {
  for (const char* path : {"weft.v1.Takes/StartTake", "//weft.v1.Takes/StartTake", "/weft.v1.Takes.StartTake",
                           "/weft/v1/Takes/StartTake", "/grpc.health.v1.Health"})
    EXPECT_GE(MethodOf(path).role, v1::ROLE_VIEWER) << path;
}

TEST(RoleWords, AreReadAsTheyAreWritten) {
  for (const v1::Role role : {v1::ROLE_VIEWER, v1::ROLE_CLIENT, v1::ROLE_OPERATOR, v1::ROLE_ADMIN})
    EXPECT_EQ(ParseRole(RoleWord(role)).value(), role);
  EXPECT_TRUE(absl::IsInvalidArgument(ParseRole("nobody").status()));
  EXPECT_TRUE(absl::IsInvalidArgument(ParseRole("").status()));
}

TEST(MethodOf, DescribesWhatIsCalled) {
  struct Expected {
    const char *path, *name;
    CallKind kind;
    bool is_ours, audited;
  };
  const Expected kExpected[] = {
      {"/weft.v1.Jobs/ListJobs", "Jobs.ListJobs", CallKind::kUnary, true, false},
      {"/weft.v1.Jobs/SubmitJob", "Jobs.SubmitJob", CallKind::kUnary, true, true},
      {"/weft.v1.Jobs/WatchJob", "Jobs.WatchJob", CallKind::kStream, true, false},
      {"/weft.v1.Library/BeginUpload", "Library.BeginUpload", CallKind::kUpload, true, true},
      // Parts of what is recorded already.
      {"/weft.v1.Library/WriteFile", "Library.WriteFile", CallKind::kUpload, true, false},
      {"/weft.v1.Sessions/RenewSession", "Sessions.RenewSession", CallKind::kUnary, true, false},
      {"/grpc.health.v1.Health/Check", "/grpc.health.v1.Health/Check", CallKind::kUnary, false, false},
      {"/grpc.health.v1.Health/Watch", "/grpc.health.v1.Health/Watch", CallKind::kStream, false, false},
      {"/weft.v2.Jobs/ListJobs", "/weft.v2.Jobs/ListJobs", CallKind::kStream, false, false}};
  for (const Expected& expected : kExpected) {
    const Method method = MethodOf(expected.path);
    EXPECT_EQ(method.name, expected.name);
    EXPECT_EQ(method.kind, expected.kind) << expected.path;
    EXPECT_EQ(method.is_ours, expected.is_ours) << expected.path;
    EXPECT_EQ(method.audited, expected.audited) << expected.path;
  }
  EXPECT_EQ(MethodOf("/weft.v2.Jobs/ListJobs").role, v1::ROLE_ADMIN) << "of a version that nobody knows";
}

}  // namespace
}  // namespace weft
