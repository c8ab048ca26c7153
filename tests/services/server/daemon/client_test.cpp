// What users read when there is no daemon, or another program.
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "tests/services/server/daemon/daemon_fixture.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

// A port on which nobody listens, held until the end of the test.
class FreePort {
 public:
  FreePort() : socket_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof(address);
    EXPECT_EQ(bind(socket_, reinterpret_cast<sockaddr*>(&address), size), 0);
    EXPECT_EQ(getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &size), 0);
    port_ = ntohs(address.sin_port);
  }
  ~FreePort() { close(socket_); }
  FreePort(const FreePort&) = delete;
  FreePort& operator=(const FreePort&) = delete;

  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }
  int socket_fd() const { return socket_; }

 private:
  const int socket_;
  int port_ = 0;
};

TEST(RegistrationClient, SaysHowToStartADaemonThatDoesNotAnswer) {
  const FreePort port;
  const absl::Status status = RegistrationClient::Connect(port.address()).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(status.message()), HasSubstr("no daemon answers at " + port.address()));
  EXPECT_THAT(std::string(status.message()), HasSubstr("`weftd --listen " + port.address()));
}

TEST(RegistrationClient, GivesUpOnAPortThatAcceptsAndSaysNothing) {
  const FreePort port;
  ASSERT_EQ(listen(port.socket_fd(), 4), 0);
  const absl::Status status =
      RegistrationClient::Connect(port.address(), std::chrono::milliseconds(300)).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable) << status;
}

TEST(RegistrationClient, RefusesWhatIsNoAddress) {
  for (const char* server : {"", "localhost", ":7411", "host:", "host:x", "host:0", "host:70000"}) {
    const absl::Status status = RegistrationClient::Connect(server).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << server;
    EXPECT_THAT(std::string(status.message()), HasSubstr("HOST:PORT"));
  }
}

TEST_F(DaemonTest, AWatchedDaemonThatGoesAwayIsNamedWithTheRemedy) {
  StartDaemon();
  const std::string id = Submit({"a"});
  WaitForEnd(id);
  const std::string address = daemon_->address();
  daemon_.reset();
  const absl::Status status = client_->Get(id).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(status.message()), HasSubstr(address));
}

}  // namespace
}  // namespace weft
