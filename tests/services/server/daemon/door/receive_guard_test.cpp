#include "services/server/daemon/door/receive_guard.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>

#include <algorithm>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "services/ground/process/unique_fd.h"
#include "services/server/rpc/message_limit.h"

namespace weft {
namespace {

// A TCP connection over the loopback, of which the guard watches the far end.
class ReceiveGuardTest : public testing::Test {
 protected:
  void SetUp() override {
    const UniqueFd listener(socket(AF_INET, SOCK_STREAM, 0));
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    auto* const generic = reinterpret_cast<sockaddr*>(&address);
    socklen_t bytes = sizeof address;
    ASSERT_EQ(bind(listener.get(), generic, bytes), 0);
    ASSERT_EQ(listen(listener.get(), 1), 0);
    ASSERT_EQ(getsockname(listener.get(), generic, &bytes), 0);
    near_ = UniqueFd(socket(AF_INET, SOCK_STREAM, 0));
    ASSERT_EQ(connect(near_.get(), generic, bytes), 0);
    far_ = UniqueFd(accept(listener.get(), nullptr, nullptr));
    ASSERT_GE(far_.get(), 0);
    ASSERT_EQ(getsockname(near_.get(), generic, &bytes), 0);
    peer_ = absl::StrCat("ipv4:127.0.0.1:", ntohs(address.sin_port));
    struct stat file = {};
    ASSERT_EQ(fstat(far_.get(), &file), 0);
    inode_ = file.st_ino;
    guard_.Add(far_.get(), inode_);
  }

  // The far end has read so much more.
  void Send(size_t bytes) {
    std::vector<char> chunk(64 << 10);
    while (bytes > 0) {
      const size_t now = std::min(bytes, chunk.size());
      ASSERT_EQ(send(near_.get(), chunk.data(), now, MSG_NOSIGNAL), static_cast<ssize_t>(now));
      ASSERT_EQ(recv(far_.get(), chunk.data(), now, MSG_WAITALL), static_cast<ssize_t>(now));
      bytes -= now;
    }
  }

  bool IsEnded() {
    const std::vector<ReceiveGuard::Ended> ended = guard_.Check();
    is_flood_ = ended.size() == 1 && ended[0].reason == ReceiveGuard::Ended::kFlood;
    return ended.size() == 1 && ended[0].inode == inode_;
  }

  ReceiveGuard guard_;
  UniqueFd near_, far_;
  std::string peer_;
  ino_t inode_ = 0;
  bool is_flood_ = false;
};

TEST_F(ReceiveGuardTest, LetsAHandshakePass) {
  Send(200 << 10);
  EXPECT_FALSE(IsEnded());
}

TEST_F(ReceiveGuardTest, WaitsForAMessageThatIsNotComplete) {
  Send(kLargestRequest_bytes + (64 << 10));
  EXPECT_FALSE(IsEnded());
}

TEST_F(ReceiveGuardTest, EndsAConnectionOfWhichNoCallComes) {
  Send(2 << 20);
  EXPECT_TRUE(IsEnded());
  char byte = 0;
  EXPECT_LE(recv(near_.get(), &byte, 1, 0), 0);
  EXPECT_FALSE(IsEnded()) << "told twice";
}

TEST_F(ReceiveGuardTest, TellsAFloodFromAMistake) {
  Send(ReceiveGuard::kMostUnheard_bytes + ReceiveGuard::kFlood_bytes / 2);
  EXPECT_TRUE(IsEnded());
  EXPECT_FALSE(is_flood_);
}

TEST_F(ReceiveGuardTest, CallsWhatIsFarBeyondAFlood) {
  Send(ReceiveGuard::kMostUnheard_bytes + 2 * ReceiveGuard::kFlood_bytes);
  EXPECT_TRUE(IsEnded());
  EXPECT_TRUE(is_flood_);
}

TEST_F(ReceiveGuardTest, TellsOfALargeConnectionThatGrpcEndedBeforeACall) {
  Send(100 << 10);
  ASSERT_FALSE(IsEnded());
  far_ = UniqueFd();
  EXPECT_TRUE(IsEnded());
  EXPECT_FALSE(IsEnded()) << "told twice";
}

TEST_F(ReceiveGuardTest, SaysNothingOfAHandshakeThatFailed) {
  Send(16 << 10);
  ASSERT_FALSE(IsEnded());
  far_ = UniqueFd();
  EXPECT_FALSE(IsEnded());
}

TEST_F(ReceiveGuardTest, SaysNothingOfAnUploadThatItsClientGaveUp) {
  guard_.HeardCall(peer_);
  Send(100 << 10);
  ASSERT_FALSE(IsEnded());
  guard_.Drained(peer_);
  far_ = UniqueFd();
  EXPECT_FALSE(IsEnded());
}

TEST_F(ReceiveGuardTest, NoticesSoonWhenAQuietConnectionBegins) {
  for (int i = 0; i < 1000; ++i) ASSERT_FALSE(IsEnded());
  Send(2 << 20);
  int checks = 1;
  while (!IsEnded() && checks < 100) ++checks;
  EXPECT_LE(checks, ReceiveGuard::kQuietChecks);
}

TEST_F(ReceiveGuardTest, WhatIsNotReadYetIsNotOwed) {
  const std::vector<char> chunk(512 << 10);
  ASSERT_GT(send(near_.get(), chunk.data(), chunk.size(), MSG_DONTWAIT), 300 << 10);
  EXPECT_FALSE(IsEnded());
}

TEST_F(ReceiveGuardTest, HoldsMessagesAgainstWhatIsSent) {
  guard_.HeardCall(peer_);
  for (int i = 0; i < 40; ++i) {
    Send(1 << 20);
    EXPECT_FALSE(IsEnded()) << i;
    guard_.HeardMessage(peer_, 1 << 20);
  }
}

TEST_F(ReceiveGuardTest, ACallMayBringAWindowAndAMessageThatAreNotHeardYet) {
  guard_.HeardCall(peer_);
  Send(2 << 20);
  EXPECT_FALSE(IsEnded());
  guard_.Drained(peer_);
  EXPECT_TRUE(IsEnded());
}

TEST_F(ReceiveGuardTest, ThousandsOfCallsMayNotOweWithoutBound) {
  for (int i = 0; i < 5000; ++i) guard_.HeardCall(peer_);
  Send(15 << 20);
  EXPECT_FALSE(IsEnded());
  Send(20 << 20);
  EXPECT_TRUE(IsEnded());
}

TEST_F(ReceiveGuardTest, EndsAConnectionWhenItIsTold) {
  guard_.End(inode_);
  char byte = 0;
  EXPECT_LE(recv(near_.get(), &byte, 1, 0), 0);
}

TEST_F(ReceiveGuardTest, LeavesAloneWhoHasTheNumberOfAClosedConnection) {
  int ends[2];
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM, 0, ends), 0);
  const UniqueFd one(ends[0]), two(ends[1]);
  ASSERT_EQ(dup2(one.get(), far_.get()), far_.get());
  guard_.End(inode_);
  EXPECT_EQ(send(far_.get(), "x", 1, MSG_NOSIGNAL), 1);
}

}  // namespace
}  // namespace weft
