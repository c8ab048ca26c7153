#include "base/loopback.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

TEST(Loopback, IsThisMachineAndNoNameThatBeginsLikeIt) {
  for (const char* here : {"localhost", "[::1]", "127.0.0.1", "127.0.0.2", "127.255.255.255"})
    EXPECT_TRUE(IsLoopbackHost(here)) << here;
  for (const char* other : {"",
                            "127.evil.invalid",
                            "127.0.0.1.evil.invalid",
                            "localhost.evil.invalid",
                            "localhost.",
                            "LOCALHOST.x",
                            "128.0.0.1",
                            "10.0.0.1",
                            "0.0.0.0",
                            "0x7f000001",
                            "0x7f.0.0.1",
                            "2130706433",
                            "0177.0.0.1",
                            "127.1",
                            "127.0.0.01",
                            "127.0.0.256",
                            " 127.0.0.1",
                            "127.0.0.1 ",
                            "[::2]",
                            "[::ffff:127.0.0.1]",
                            "[::1",
                            "::1",
                            "user@127.0.0.1",
                            "127.0.0.1@evil.invalid"})
    EXPECT_FALSE(IsLoopbackHost(other)) << other;
}

}  // namespace
}  // namespace weft
