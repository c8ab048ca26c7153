#include "services/ground/process/child_environment.h"

#include <gmock/gmock.h>

#include <cstdlib>

namespace weft {
namespace {

using testing::Contains;
using testing::Each;
using testing::HasSubstr;
using testing::Not;

TEST(ChildEnvironment, LeavesOutWhatIsNamedASecret) {
  for (const char* name : {"AWS_SECRET_ACCESS_KEY", "GITHUB_TOKEN", "WEFT_TOKEN", "PGPASSWORD", "smtp_passwd",
                           "Vault_Credentials", "STUDIO_API_KEY", "TLS_PRIVATE_KEY", "SLACK_WEBHOOK",
                           "MY_SECRET", "MAPS_APIKEY", "GPG_PASSPHRASE", "S3_ACCESS_KEY"}) {
    EXPECT_TRUE(IsNameOfSecret(name)) << name;
    setenv(name, "hidden-value", 1);
  }
  for (const char* name :
       {"PATH", "HOME", "LD_PRELOAD", "LC_ALL", "TZ", "XDG_CACHE_HOME", "KEYBOARD", "SLURM_CONF"}) {
    EXPECT_FALSE(IsNameOfSecret(name)) << name;
  }
  setenv("TZ", "Europe/Zurich=", 1);
  EXPECT_THAT(EnvironmentWithoutSecrets(), Each(Not(HasSubstr("hidden-value"))));
  EXPECT_THAT(EnvironmentWithoutSecrets(), Contains("TZ=Europe/Zurich="));
}

}  // namespace
}  // namespace weft
