#include "services/server/rpc/service_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <string>

namespace weft {
namespace {

using ::testing::Contains;
using ::testing::IsSupersetOf;

TEST(ServiceFiles, DeclareEveryServiceOnce) {
  std::set<std::string> services;
  for (const google::protobuf::FileDescriptor* file : ServiceFiles()) {
    EXPECT_EQ(file->package(), "weft.v1");
    EXPECT_GT(file->service_count(), 0) << file->name();
    for (int i = 0; i < file->service_count(); ++i)
      EXPECT_TRUE(services.insert(file->service(i)->name()).second) << file->service(i)->name();
  }
  EXPECT_THAT(services, IsSupersetOf({"Jobs", "Takes", "Server", "Sessions", "Library", "Operations"}));
}

TEST(ServiceFiles, NameMethodsAsHttp2Does) {
  std::set<std::string> paths;
  for (const google::protobuf::MethodDescriptor* method : ServiceMethods())
    EXPECT_TRUE(paths.insert(PathOf(*method)).second) << PathOf(*method);
  EXPECT_THAT(paths, Contains("/weft.v1.Takes/StartTake"));
  EXPECT_THAT(paths, Contains("/weft.v1.Jobs/SubmitJob"));
}

}  // namespace
}  // namespace weft
