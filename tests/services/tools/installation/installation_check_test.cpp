#include "services/tools/installation/installation_check.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

TEST(InstallationCheck, AsksADaemonAtItsFirstAddress) {
  v1::DaemonConfig config;
  EXPECT_EQ(FirstAddressOf(config), "");
  config.set_state("/var/lib/weft");
  EXPECT_EQ(FirstAddressOf(config), "unix:/var/lib/weft/weftd.sock");
  config.add_listen("studio:7411");
  config.add_listen("unix:/run/weft.sock");
  EXPECT_EQ(FirstAddressOf(config), "studio:7411");
}

}  // namespace
}  // namespace weft
