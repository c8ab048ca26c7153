#include "services/server/daemon/door/listen_address.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(ListenAddressText, IsASocketOrAHostWithItsPort) {
  const auto socket = ParseListenAddress("unix:/run/weft/weftd.sock");
  ASSERT_TRUE(socket.ok());
  EXPECT_EQ(socket->kind, ListenKind::kUnixSocket);
  EXPECT_EQ(socket->path, "/run/weft/weftd.sock");
  const auto v4 = ParseListenAddress("127.0.0.1:7411");
  ASSERT_TRUE(v4.ok());
  EXPECT_EQ(v4->kind, ListenKind::kLoopback);
  EXPECT_EQ(v4->host, "127.0.0.1");
  EXPECT_EQ(v4->port, 7411);
  const auto v6 = ParseListenAddress("[::1]:0");
  ASSERT_TRUE(v6.ok());
  EXPECT_EQ(v6->kind, ListenKind::kLoopback);
  EXPECT_EQ(v6->host, "::1");
}

// Only what no other machine reaches may go without TLS.
TEST(ListenAddressText, IsOfTheNetworkUnlessItIsLoopback) {
  for (const char* text : {"0.0.0.0:1", "[::]:1", "192.0.2.7:7411", "128.0.0.1:1"}) {
    const auto address = ParseListenAddress(text);
    ASSERT_TRUE(address.ok()) << text;
    EXPECT_EQ(address->kind, ListenKind::kNetwork) << text;
  }
  EXPECT_EQ(ParseListenAddress("127.255.0.1:1")->kind, ListenKind::kLoopback);
}

TEST(ListenAddressText, IsRefusedWhereItIsNeither) {
  for (const char* text : {"", ":1", "127.0.0.1", "127.0.0.1:", "127.0.0.1:x", "127.0.0.1:-1",
                           "127.0.0.1:65536", "unix:", "unix:weftd.sock"}) {
    const absl::Status status = ParseListenAddress(text).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(std::string(status.message()), HasSubstr("--listen: \"" + std::string(text) + "\"")) << text;
  }
  EXPECT_TRUE(ParseListenAddress("127.0.0.1:65535").ok());
}

// unix(7): sun_path has 108 bytes, the last one for the end of the string.
TEST(ListenAddressText, HoldsThePathOfASocket) {
  EXPECT_TRUE(ParseListenAddress("unix:/" + std::string(106, 's')).ok());
  EXPECT_THAT(std::string(ParseListenAddress("unix:/" + std::string(107, 's')).status().message()),
              HasSubstr("at most 107 characters"));
}

TEST(ListenAt, ChoosesAPortThatNobodyElseGets) {
  const auto first = ListenAt(*ParseListenAddress("127.0.0.1:0"));
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_THAT(first->address, HasSubstr("127.0.0.1:"));
  EXPECT_THAT(first->address, Not(HasSubstr(":0")));
  const absl::Status second = ListenAt(*ParseListenAddress(first->address)).status();
  EXPECT_EQ(second.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(second.message()), HasSubstr(first->address));
}

TEST(ListenAt, SaysWhyItCannot) {
  const absl::Status status = ListenAt(*ParseListenAddress("192.0.2.7:7411")).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(
      status.message(),
      "--listen: 192.0.2.7:7411 cannot be listened on (Cannot assign requested address); is another program "
      "using it, or is the address not one of this machine's?");
}

TEST(ListenAt, ASocketIsItsOwnersAndReplacedWhenLeftBehind) {
  const TempFolder folder;
  const ListenAddress address = *ParseListenAddress("unix:" + (folder / "s"));
  {
    const auto first = ListenAt(address);
    ASSERT_TRUE(first.ok()) << first.status();
    struct stat info = {};
    ASSERT_EQ(stat((folder / "s").c_str(), &info), 0);
    EXPECT_EQ(info.st_mode & 0777, 0600u);
    EXPECT_EQ(ListenAt(address).status().code(), absl::StatusCode::kFailedPrecondition);
  }
  EXPECT_TRUE(std::filesystem::exists(folder / "s"));
  EXPECT_TRUE(ListenAt(address).ok());
}

TEST(ListenAt, LeavesAFileOfThatNameAlone) {
  const TempFolder folder;
  WriteBytes(folder / "s", "text");
  EXPECT_FALSE(ListenAt(*ParseListenAddress("unix:" + (folder / "s"))).ok());
  EXPECT_EQ(ReadBytes(folder / "s"), "text");
}

}  // namespace
}  // namespace weft
