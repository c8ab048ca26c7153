// Which machines count as one.
#include "services/server/callers/network.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

TEST(NetworkTest, AddressesOfIpv6AreOneMachinePerNetwork) {
  EXPECT_EQ(NetworkOf("2001:db8:1:2::5"), "2001:db8:1:2::/64");
  EXPECT_EQ(NetworkOf("2001:0db8:0001:0002:ffff:ffff:ffff:ffff"), "2001:db8:1:2::/64");
  EXPECT_NE(NetworkOf("2001:db8:1:3::5"), NetworkOf("2001:db8:1:2::5"));
  EXPECT_EQ(NetworkOf("fe80::1%eth0"), "fe80::/64");
}

TEST(NetworkTest, OthersAreThemselves) {
  EXPECT_EQ(NetworkOf("10.0.0.5"), "10.0.0.5");
  EXPECT_EQ(NetworkOf("::ffff:10.0.0.5"), "10.0.0.5");
  EXPECT_EQ(NetworkOf("::1"), "::1");
  EXPECT_EQ(NetworkOf("user anna"), "user anna");
  EXPECT_EQ(NetworkOf(""), "");
}

}  // namespace
}  // namespace weft
