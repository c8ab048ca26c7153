// How many clients are connected at once, and what is told of those that are too many.
#include "services/server/daemon/door/connections.h"

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/security/server_credentials.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>

#include "services/server/access/access_control.h"
#include "services/server/access/access_list.h"
#include "services/server/access/audit_log.h"
#include "services/server/daemon/door/listen_address.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/server/daemon/wait_until.h"
#include "weft/v1/server.grpc.pb.h"

namespace weft {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class ConnectionsTest : public ::testing::Test {
 protected:
  void Start(ListenKind kind, const ConnectionLimits& limits) {
    ListeningSocket socket;
    if (kind == ListenKind::kUnixSocket) socket = *ListenAt(*ParseListenAddress("unix:" + (folder_ / "s")));
    socket.kind = kind;
    std::vector<ListeningSocket> sockets;
    sockets.push_back(std::move(socket));
    audit_ = *AuditLog::Open(AuditLogFile(folder_.path()), [](const std::string&) {});
    const CallerSources sources{access_, call_limits_, *audit_, guard_, nullptr, {}};
    grpc::ServerBuilder builder;
    builder.RegisterService(&service_);
    connections_ = std::make_unique<Connections>(
        std::move(sockets), limits, sources,
        [](ListenKind) { return grpc::experimental::LocalServerCredentials(UDS); }, builder);
    server_ = builder.BuildAndStart();
    ASSERT_NE(server_, nullptr);
    const absl::Status begun = connections_->Begin();
    ASSERT_TRUE(begun.ok()) << begun;
  }
  ~ConnectionsTest() override {
    connections_->Stop();
    server_->Shutdown(std::chrono::system_clock::now());
  }

  UniqueFd Connect() {
    const std::string path = folder_ / "s";
    sockaddr_un name{};
    name.sun_family = AF_UNIX;
    std::memcpy(name.sun_path, path.c_str(), path.size() + 1);
    UniqueFd connection(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
    EXPECT_EQ(connect(connection.get(), reinterpret_cast<const sockaddr*>(&name), sizeof name), 0);
    return connection;
  }
  // "PEER OUTCOME TIMES MESSAGE" of what was refused.
  std::vector<std::string> Refused() const {
    std::vector<std::string> lines;
    const std::vector<v1::AuditEntry> log = *ReadAuditLog(AuditLogFile(folder_.path()), 1000);
    for (const v1::AuditEntry& entry : log)
      lines.push_back(
          absl::StrCat(entry.peer(), " ", entry.outcome(), " ", entry.times(), " ", entry.message()));
    return lines;
  }

  const TempFolder folder_;
  const UniqueFd any_{socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)};  // a daemon has sockets besides
  AccessControl access_{AccessListFile(folder_.path()), [](const std::string&) {}};
  CallLimits call_limits_{CallerLimits()};
  std::unique_ptr<AuditLog> audit_;
  ReceiveGuard guard_;
  v1::Server::Service service_;
  std::unique_ptr<Connections> connections_;
  std::unique_ptr<grpc::Server> server_;
};

TEST_F(ConnectionsTest, OnePeerHasSoManyAtOnce) {
  Start(ListenKind::kUnixSocket, {.all = 100, .of_one_peer = 3, .reserve = 1});
  EXPECT_EQ(connections_->most(), 100);
  std::vector<UniqueFd> open;
  for (int i = 0; i < 3; ++i) open.push_back(Connect());
  ASSERT_TRUE(WaitUntil([this] { return connections_->open() == 3; }));
  const UniqueFd refused = Connect();
  char byte = 0;
  EXPECT_LE(recv(refused.get(), &byte, 1, 0), 0) << "it is closed at once";
  ASSERT_TRUE(WaitUntil([this] { return !Refused().empty(); }));
  EXPECT_THAT(Refused()[0],
              ::testing::MatchesRegex("user [^ ]+ REFUSED 1 refused: it has 3 open, all clients together 3"));
  // One that goes makes room.
  open.pop_back();
  ASSERT_TRUE(WaitUntil([this] { return connections_->open() == 2; }));
  open.push_back(Connect());
  ASSERT_TRUE(WaitUntil([this] { return connections_->open() == 3; }));
  EXPECT_EQ(Refused().size(), 1u);
  open.clear();
  ASSERT_TRUE(WaitUntil([this] { return Refused().size() == 2; }));
  EXPECT_THAT(Refused()[1],
              HasSubstr(" REFUSED 4 ended without a call, which a failed TLS handshake does as well"));
  EXPECT_EQ(connections_->open(), 0);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "s"));
  connections_->Stop();
  EXPECT_FALSE(std::filesystem::exists(folder_ / "s"));
}

TEST_F(ConnectionsTest, AFewBrowsersLeaveRoomForTheNext) {
  Start(ListenKind::kConsole, {.all = 8, .of_one_peer = 5, .reserve = 1});
  std::vector<UniqueFd> of_first;
  for (int i = 0; i < 2; ++i) {
    auto connection = connections_->ConnectConsole("10.0.0.5");
    ASSERT_TRUE(connection.ok()) << connection.status();
    of_first.push_back(*std::move(connection));
  }
  EXPECT_EQ(connections_->open(), 2);
  EXPECT_EQ(connections_->ConnectConsole("10.0.0.5").status(),
            absl::ResourceExhaustedError("too many clients are connected; try again in a minute"));
  const auto of_second = connections_->ConnectConsole("10.0.0.6");
  ASSERT_TRUE(of_second.ok()) << of_second.status();
  EXPECT_EQ(connections_->open(), 3);
  ASSERT_TRUE(WaitUntil([this] { return !Refused().empty(); }));
  EXPECT_THAT(Refused(),
              Contains("10.0.0.5 (console) REFUSED 1 refused: it has 2 open, all clients together 2"));
  of_first.clear();
  EXPECT_TRUE(WaitUntil([this] { return connections_->open() == 1; }));
  EXPECT_TRUE(connections_->ConnectConsole("10.0.0.5").ok());
}

TEST_F(ConnectionsTest, HaveNoBrowsersWithoutAConsole) {
  Start(ListenKind::kUnixSocket, {});
  EXPECT_FALSE(connections_->ConnectConsole("10.0.0.5").ok());
  EXPECT_THAT(Refused(), IsEmpty());
}

}  // namespace
}  // namespace weft
