// Whom a daemon lets in, and to what.
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>

#include <fstream>
#include <map>
#include <set>
#include <thread>

#include "absl/strings/match.h"
#include "services/ground/process/unique_fd.h"
#include "services/server/access/access_list.h"
#include "services/server/access/audit_log.h"
#include "services/server/daemon/door/connections.h"
#include "services/server/daemon/door/listen_address.h"
#include "services/server/rpc/service_files.h"
#include "services/tools/client/channel.h"
#include "tests/services/server/access/certificate_maker.h"
#include "tests/services/server/daemon/daemon_fixture.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

// Who may call what, once more beside the schemas: a method that is added stands here, too.
const std::map<std::string, v1::Role>& ExpectedRoles() {
  static const std::map<std::string, v1::Role> roles = {{"Cameras.ListCameras", v1::ROLE_VIEWER},
                                                        {"Cameras.LookAtCameras", v1::ROLE_OPERATOR},
                                                        {"Jobs.CancelJob", v1::ROLE_CLIENT},
                                                        {"Jobs.FetchResult", v1::ROLE_VIEWER},
                                                        {"Jobs.GetJob", v1::ROLE_VIEWER},
                                                        {"Jobs.ListFrames", v1::ROLE_VIEWER},
                                                        {"Jobs.ListJobs", v1::ROLE_VIEWER},
                                                        {"Jobs.ListWorkKinds", v1::ROLE_VIEWER},
                                                        {"Jobs.RetryJob", v1::ROLE_CLIENT},
                                                        {"Jobs.SetJobPriority", v1::ROLE_CLIENT},
                                                        {"Jobs.SubmitJob", v1::ROLE_CLIENT},
                                                        {"Jobs.WatchJob", v1::ROLE_VIEWER},
                                                        {"Library.BeginUpload", v1::ROLE_CLIENT},
                                                        {"Library.DeleteItem", v1::ROLE_OPERATOR},
                                                        {"Library.FetchFile", v1::ROLE_VIEWER},
                                                        {"Library.FinishUpload", v1::ROLE_CLIENT},
                                                        {"Library.GetItem", v1::ROLE_VIEWER},
                                                        {"Library.ListItems", v1::ROLE_VIEWER},
                                                        {"Library.WriteFile", v1::ROLE_CLIENT},
                                                        {"Operations.CancelOperation", v1::ROLE_CLIENT},
                                                        {"Operations.DeleteOperation", v1::ROLE_CLIENT},
                                                        {"Operations.FetchOperationFile", v1::ROLE_VIEWER},
                                                        {"Operations.GetOperation", v1::ROLE_VIEWER},
                                                        {"Operations.ListOperationFiles", v1::ROLE_VIEWER},
                                                        {"Operations.ListOperations", v1::ROLE_VIEWER},
                                                        {"Operations.StartOperation", v1::ROLE_CLIENT},
                                                        {"Operations.WatchOperation", v1::ROLE_VIEWER},
                                                        {"Server.Drain", v1::ROLE_ADMIN},
                                                        {"Server.GetServerInfo", v1::ROLE_VIEWER},
                                                        {"Server.RehearseRetention", v1::ROLE_OPERATOR},
                                                        {"Sessions.CloseSession", v1::ROLE_OPERATOR},
                                                        {"Sessions.GetSession", v1::ROLE_VIEWER},
                                                        {"Sessions.ListSessions", v1::ROLE_VIEWER},
                                                        {"Sessions.OpenSession", v1::ROLE_OPERATOR},
                                                        {"Sessions.RenewSession", v1::ROLE_OPERATOR},
                                                        {"Takes.DeleteTake", v1::ROLE_OPERATOR},
                                                        {"Takes.DescribeTake", v1::ROLE_OPERATOR},
                                                        {"Takes.EmptyTrash", v1::ROLE_ADMIN},
                                                        {"Takes.GetTake", v1::ROLE_VIEWER},
                                                        {"Takes.ListTakes", v1::ROLE_VIEWER},
                                                        {"Takes.PinTake", v1::ROLE_OPERATOR},
                                                        {"Takes.RestoreTake", v1::ROLE_OPERATOR},
                                                        {"Takes.StartTake", v1::ROLE_OPERATOR},
                                                        {"Takes.StopTake", v1::ROLE_OPERATOR},
                                                        {"Takes.WatchTake", v1::ROLE_VIEWER}};
  return roles;
}

// Sends one empty message, and says how the call ended.
grpc::Status CallOnce(const std::shared_ptr<grpc::Channel>& channel, const std::string& path) {
  grpc::GenericStub stub(channel);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(10));
  grpc::CompletionQueue queue;
  const auto wait = [&queue] {
    void* tag = nullptr;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  const auto call = stub.PrepareCall(&context, path, &queue);
  call->StartCall(nullptr);
  wait();
  const grpc::Slice nothing;
  call->WriteLast(grpc::ByteBuffer(&nothing, 1), grpc::WriteOptions(), nullptr);
  wait();
  for (bool goes_on = true; goes_on;) {
    grpc::ByteBuffer answer;
    call->Read(&answer, nullptr);
    goes_on = wait();
  }
  grpc::Status status;
  call->Finish(&status, nullptr);
  wait();
  return status;
}

// A daemon that other machines reach.
class DaemonAccessTest : public DaemonTest {
 protected:
  DaemonAccessTest() {
    options_.listen = {"0.0.0.0:0"};
    const CertificateFiles server = maker_.Sign("weftd");
    options_.tls = {server.certificate, server.key, maker_.authority(), ""};
    list_ = AccessListFile(options_.state_folder);
    std::filesystem::create_directories(options_.state_folder);
  }

  void StartListening() {
    absl::StatusOr<std::unique_ptr<Daemon>> daemon = Daemon::Start(options_);
    ASSERT_TRUE(daemon.ok()) << daemon.status();
    daemon_ = *std::move(daemon);
    address_ = "127.0.0.1:" + daemon_->address().substr(daemon_->address().rfind(':') + 1);
  }

  std::shared_ptr<grpc::Channel> Open(const ClientIdentity& identity) {
    return OpenChannel(address_, identity).value();
  }
  ClientIdentity WithToken(const std::string& text) {
    const std::string path = folder_ / ("token" + std::to_string(++tokens_));
    std::ofstream(path) << text << "\n";
    return {path, maker_.authority(), "", ""};
  }
  ClientIdentity WithRole(v1::Role role) { return WithToken(AddToken(list_, {"anna", role}).value().text); }

  static constexpr char kInfo[] = "/weft.v1.Server/GetServerInfo";
  CertificateMaker maker_{folder_.path(), "studio"};
  std::string list_, address_;
  int tokens_ = 0;
};

TEST_F(DaemonAccessTest, EveryMethodAsksForItsRole) {
  const v1::Role roles[] = {v1::ROLE_VIEWER, v1::ROLE_CLIENT, v1::ROLE_OPERATOR, v1::ROLE_ADMIN};
  std::map<v1::Role, std::shared_ptr<grpc::Channel>> channels;
  std::map<v1::Role, ClientIdentity> identities;
  for (const v1::Role role : roles) identities[role] = WithRole(role);
  StartListening();
  for (const v1::Role role : roles) channels[role] = Open(identities[role]);
  const std::shared_ptr<grpc::Channel> stranger = Open({"", maker_.authority(), "", ""});
  size_t methods = 0;
  for (const google::protobuf::MethodDescriptor* method : ServiceMethods()) {
    const std::string name = method->service()->name() + "." + method->name();
    const auto expected = ExpectedRoles().find(name);
    ASSERT_NE(expected, ExpectedRoles().end()) << name << " is new: say here who may call it";
    ++methods;
    const grpc::Status unknown = CallOnce(stranger, PathOf(*method));
    EXPECT_EQ(unknown.error_code(), grpc::StatusCode::UNAUTHENTICATED) << name;
    for (const v1::Role role : roles) {
      const grpc::Status status = CallOnce(channels[role], PathOf(*method));
      const bool refused = status.error_code() == grpc::StatusCode::PERMISSION_DENIED &&
                           absl::StrContains(status.error_message(), "asks for the role");
      EXPECT_EQ(refused, role < expected->second)
          << name << " " << v1::Role_Name(role) << " " << status.error_message();
      EXPECT_NE(status.error_code(), grpc::StatusCode::UNAUTHENTICATED) << name;
    }
  }
  EXPECT_EQ(methods, ExpectedRoles().size());
  daemon_->Stop();
  // All refusals are recorded, and what was let in where it changes something.
  std::set<std::string> refused, done;
  const std::vector<v1::AuditEntry> log = ReadAuditLog(AuditLogFile(options_.state_folder), 100000).value();
  for (const v1::AuditEntry& entry : log) {
    const bool is_refusal =
        entry.outcome() == "UNAUTHENTICATED" || absl::StrContains(entry.message(), "asks for the role");
    (is_refusal ? refused : done).insert(entry.method());
  }
  for (const auto& [name, role] : ExpectedRoles()) {
    EXPECT_TRUE(refused.contains(name)) << name;
    const bool is_part = name == "Library.WriteFile" || name == "Sessions.RenewSession";
    EXPECT_EQ(done.contains(name), role > v1::ROLE_VIEWER && !is_part) << name;
  }
}

TEST_F(DaemonAccessTest, HealthIsForEverybodyAndReflectionIsNot) {
  StartListening();
  const std::shared_ptr<grpc::Channel> stranger = Open({"", maker_.authority(), "", ""});
  EXPECT_TRUE(CallOnce(stranger, "/grpc.health.v1.Health/Check").ok());
  EXPECT_EQ(CallOnce(stranger, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo").error_code(),
            grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(CallOnce(stranger, "/no.such/Method").error_code(), grpc::StatusCode::UNAUTHENTICATED);
  // A name of a client's making is cut where it is written down.
  CallOnce(stranger, "/" + std::string(300, 'x') + "/Method");
  daemon_->Stop();
  size_t longest = 0;
  const std::vector<v1::AuditEntry> log = ReadAuditLog(AuditLogFile(options_.state_folder), 100).value();
  for (const v1::AuditEntry& entry : log) longest = std::max(longest, entry.method().size());
  EXPECT_EQ(longest, 200U);
}

TEST_F(DaemonAccessTest, TokensComeAndGoWithoutARestart) {
  StartListening();
  const NewToken added = AddToken(list_, {"anna", v1::ROLE_VIEWER}).value();
  std::this_thread::sleep_for(std::chrono::milliseconds(600));
  const std::shared_ptr<grpc::Channel> channel = Open(WithToken(added.text));
  EXPECT_TRUE(CallOnce(channel, kInfo).ok());
  ASSERT_TRUE(RevokeAccess(list_, added.token.id()).ok());
  std::this_thread::sleep_for(std::chrono::milliseconds(600));
  const grpc::Status status = CallOnce(channel, kInfo);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_THAT(status.error_message(), HasSubstr("unknown or was revoked"));
}

TEST_F(DaemonAccessTest, KnowsClientsByCertificatesOfItsAuthorityAlone) {
  ASSERT_TRUE(AllowCertificate(list_, "render-1", v1::ROLE_VIEWER).ok());
  CertificateMaker foreign(folder_.path(), "foreign");
  const CertificateFiles known = maker_.Sign("render-1"), without_role = maker_.Sign("render-2"),
                         expired = maker_.Sign("render-1", 0), of_others = foreign.Sign("render-1");
  StartListening();
  const auto call = [&](const CertificateFiles& files) {
    return CallOnce(Open({"", maker_.authority(), files.certificate, files.key}), kInfo).error_code();
  };
  EXPECT_EQ(call(known), grpc::StatusCode::OK);
  EXPECT_EQ(call(without_role), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(call(expired), grpc::StatusCode::UNAVAILABLE);  // no connection
  EXPECT_EQ(call(of_others), grpc::StatusCode::UNAVAILABLE);
}

TEST_F(DaemonAccessTest, RevokedCertificatesEndOnOpenConnections) {
  ASSERT_TRUE(AllowCertificate(list_, "render-1", v1::ROLE_VIEWER).ok());
  options_.tls.client_revocations = folder_ / "revoked.crl";
  maker_.Revoke(maker_.Sign("somebody"), options_.tls.client_revocations);
  const CertificateFiles files = maker_.Sign("render-1");
  StartListening();
  const std::shared_ptr<grpc::Channel> channel = Open({"", maker_.authority(), files.certificate, files.key});
  EXPECT_TRUE(CallOnce(channel, kInfo).ok());
  maker_.Revoke(files, options_.tls.client_revocations);
  const grpc::Status status = CallOnce(channel, kInfo);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_THAT(status.error_message(), HasSubstr("revoked"));
}

TEST_F(DaemonAccessTest, SpeaksToNoClientWithoutTls) {
  StartListening();
  const auto plain = grpc::CreateChannel(address_, grpc::InsecureChannelCredentials());
  EXPECT_EQ(CallOnce(plain, kInfo).error_code(), grpc::StatusCode::UNAVAILABLE);
}

TEST_F(DaemonAccessTest, RefusesToListenBeyondThisMachineWithoutTls) {
  options_.tls = {};
  for (const char* address : {"0.0.0.0:0", "[::]:0"}) {
    options_.listen = {address};
    const absl::Status status = Daemon::Start(options_).status();
    EXPECT_TRUE(absl::IsInvalidArgument(status)) << address;
    EXPECT_THAT(std::string(status.message()), HasSubstr("--tls-cert"));
  }
}

TEST_F(DaemonTest, ListensOnASocketOfItsOwnByDefault) {
  options_.listen = {};
  StartDaemon();
  EXPECT_THAT(daemon_->address(), StartsWith("unix:/"));
  const std::string path = daemon_->address().substr(5);
  EXPECT_EQ(std::filesystem::canonical(path), std::filesystem::canonical(folder_ / "state/weftd.sock"));
  struct stat file = {};
  ASSERT_EQ(stat(path.c_str(), &file), 0);
  EXPECT_EQ(file.st_mode & 0777, 0600U);
  EXPECT_TRUE(client_->List(1).ok());
}

TEST_F(DaemonTest, ReplacesTheSocketOfADaemonThatIsGone) {
  const std::string path = folder_ / "weftd.sock";
  options_.listen = {"unix:" + path, "127.0.0.1:0"};
  {
    const absl::StatusOr<ListeningSocket> killed = ListenAt({ListenKind::kUnixSocket, "unix:" + path, path});
    ASSERT_TRUE(killed.ok()) << killed.status();
  }
  ASSERT_TRUE(std::filesystem::exists(path));
  StartDaemon();
  ASSERT_EQ(daemon_->addresses().size(), 2U);
  Connect(daemon_->addresses()[1]);
  EXPECT_TRUE(client_->List(1).ok());
  daemon_->Stop();
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST(ConnectionLimits, StayBelowTheDescriptors) {
  EXPECT_EQ(LimitsFor(1 << 20).all, 1000);
  EXPECT_EQ(LimitsFor(1 << 20).of_one_peer, 250);
  for (const int descriptors : {512, 1024, 1200}) {
    const ConnectionLimits limits = LimitsFor(descriptors);
    EXPECT_LE(limits.all + limits.reserve, descriptors - 200);
    EXPECT_LE(limits.of_one_peer, limits.all / 2);
  }
  const struct {
    int descriptors, all, of_one_peer;
  } exact[] = {{1272, 1000, 250}, {1271, 999, 250}, {512, 240, 120}, {304, 32, 16}, {64, 32, 16}};
  for (const auto& c : exact) {
    EXPECT_EQ(LimitsFor(c.descriptors).all, c.all) << c.descriptors;
    EXPECT_EQ(LimitsFor(c.descriptors).of_one_peer, c.of_one_peer) << c.descriptors;
  }
}

TEST_F(DaemonTest, LeavesFilesThatAreNoSocketsAlone) {
  options_.listen = {"unix:" + (folder_ / "rig.json")};
  EXPECT_TRUE(absl::IsFailedPrecondition(Daemon::Start(options_).status()));
  EXPECT_EQ(ReadBytes(folder_ / "rig.json"), "{}");
}

// The descriptors of this process, as most machines limit them.
class FewDescriptors {
 public:
  FewDescriptors() {
    getrlimit(RLIMIT_NOFILE, &before_);
    rlimit few = before_;
    few.rlim_cur = 1024;
    setrlimit(RLIMIT_NOFILE, &few);
  }
  ~FewDescriptors() { setrlimit(RLIMIT_NOFILE, &before_); }

 private:
  rlimit before_{};
};

// CVE-2023-4785: gRPC's own listener accepts nobody again, once descriptors ran out.
TEST_F(DaemonTest, AcceptsClientsAgainAfterAFloodOfConnections) {
  StartDaemon();
  sockaddr_in there{};
  there.sin_family = AF_INET;
  there.sin_port =
      htons(static_cast<uint16_t>(std::stoi(daemon_->address().substr(daemon_->address().rfind(':') + 1))));
  there.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  {
    const FewDescriptors limit;
    std::vector<UniqueFd> flood;
    for (bool has_descriptors = true; has_descriptors;) {
      UniqueFd one(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
      has_descriptors = one.open();
      connect(one.get(), reinterpret_cast<const sockaddr*>(&there), sizeof(there));
      flood.push_back(std::move(one));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(500));  // nobody can be accepted
  }
  EXPECT_TRUE(client_->List(1).ok());  // who is connected stays
  Connect(daemon_->address());
  EXPECT_TRUE(client_->List(1).ok());
}

}  // namespace
}  // namespace weft
