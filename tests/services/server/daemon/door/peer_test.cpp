// Whose connection it is.
#include "services/server/daemon/door/peer.h"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "services/ground/process/unique_fd.h"

namespace weft {
namespace {

// A listening socket on loopback, whose connections this process or another user's makes.
class Loopback {
 public:
  Loopback() : listening_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    address_.sin_family = AF_INET;
    address_.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    bind(listening_.get(), generic(), sizeof(address_));
    listen(listening_.get(), 8);
    socklen_t size = sizeof(address_);
    getsockname(listening_.get(), reinterpret_cast<sockaddr*>(&address_), &size);
  }

  UniqueFd Connect() const {
    UniqueFd connection(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    EXPECT_EQ(connect(connection.get(), generic(), sizeof(address_)), 0);
    return connection;
  }
  UniqueFd Accept() const { return UniqueFd(accept4(listening_.get(), nullptr, nullptr, SOCK_CLOEXEC)); }

 private:
  const sockaddr* generic() const { return reinterpret_cast<const sockaddr*>(&address_); }

  sockaddr_in address_{};
  UniqueFd listening_;
};

TEST(PeerOf, IsTheUserOfALoopbackConnection) {
  const Loopback loopback;
  const UniqueFd client = loopback.Connect(), other = loopback.Connect();
  const Peer peer = PeerOf(loopback.Accept().get());
  EXPECT_EQ(peer.uid, geteuid());
  EXPECT_FALSE(TrustedUserOf(peer).empty());
  EXPECT_EQ(peer, PeerOf(loopback.Accept().get()));
}

TEST(PeerOf, IsTheUserOfASocketPair) {
  int ends[2];
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM, 0, ends), 0);
  const UniqueFd here(ends[0]), there(ends[1]);
  EXPECT_EQ(PeerOf(here.get()).uid, geteuid());
}

TEST(PeerOf, KnowsAnotherUser) {
  if (geteuid() != 0) GTEST_SKIP() << "only root may become another user";
  constexpr uid_t kOther = 65534;
  const Loopback loopback;
  int release[2];
  ASSERT_EQ(pipe(release), 0);
  const pid_t child = fork();
  if (child == 0) {
    close(release[1]);
    if (setresuid(kOther, kOther, kOther) != 0) _exit(1);
    const UniqueFd client = loopback.Connect();
    char byte = 0;
    _exit(read(release[0], &byte, 1) == 0 ? 0 : 1);  // until the parent has looked
  }
  const Peer peer = PeerOf(loopback.Accept().get());
  close(release[0]);
  close(release[1]);
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(peer.uid, kOther);
  EXPECT_EQ(TrustedUserOf(peer), "");
}

// The kernel calls such a socket root's: whoever sends and leaves at once would be root.
TEST(PeerOf, TrustsNobodyWhoHasClosed) {
  const Loopback loopback;
  for (const bool resets : {false, true}) {
    UniqueFd client = loopback.Connect();
    const UniqueFd accepted = loopback.Accept();
    const linger at_once{resets, 0};
    setsockopt(client.get(), SOL_SOCKET, SO_LINGER, &at_once, sizeof(at_once));
    EXPECT_EQ(write(client.get(), "request", 7), 7);
    client.Close();
    EXPECT_EQ(PeerOf(accepted.get()).uid, std::nullopt) << resets;
  }
  EXPECT_EQ(TrustedUserOf(PeerOf(-1)), "");
}

}  // namespace
}  // namespace weft
