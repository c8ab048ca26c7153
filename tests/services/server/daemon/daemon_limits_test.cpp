// What one client may take from the others, and what the audit log tells of it.
#include <absl/strings/str_split.h>
#include <grpcpp/grpcpp.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <thread>

#include "services/ground/process/unique_fd.h"
#include "services/server/access/access_list.h"
#include "services/server/access/audit_log.h"
#include "services/server/rpc/retry_after.h"
#include "services/tools/client/channel.h"
#include "tests/services/server/daemon/daemon_fixture.h"
#include "weft/v1/jobs.grpc.pb.h"
#include "weft/v1/server.grpc.pb.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

class DaemonLimitsTest : public DaemonTest {
 protected:
  // Callers with tokens, so that they are others than the test's user.
  DaemonLimitsTest() {
    std::filesystem::create_directories(options_.state_folder);
    for (const char* name : {"greedy", "modest"}) {
      std::ofstream(folder_ / name)
          << AddToken(AccessListFile(options_.state_folder), {name, v1::ROLE_CLIENT}).value().text;
    }
  }
  std::shared_ptr<grpc::Channel> ClientNamed(const std::string& name) {
    return OpenChannel(daemon_->address(), {folder_ / name, "", "", ""}).value();
  }
  sockaddr_in Address() const {
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port =
        htons(static_cast<uint16_t>(std::stoi(daemon_->address().substr(daemon_->address().rfind(':') + 1))));
    return address;
  }
  static grpc::Status Ask(const std::shared_ptr<grpc::Channel>& channel) {
    grpc::ClientContext context;
    v1::ServerInfo info;
    return v1::Server::NewStub(channel)->GetServerInfo(&context, {}, &info);
  }
  // The entries of a method that say this.
  std::vector<v1::AuditEntry> Audited(const std::string& method, const std::string& words = "") {
    std::vector<v1::AuditEntry> found;
    const std::vector<v1::AuditEntry> log = ReadAuditLog(AuditLogFile(options_.state_folder), 10000).value();
    for (const v1::AuditEntry& entry : log) {
      if (entry.method() == method && entry.message().find(words) != std::string::npos)
        found.push_back(entry);
    }
    return found;
  }
  // Records follow answers.
  std::vector<v1::AuditEntry> WaitUntilAudited(const std::string& method, const std::string& words = "") {
    for (int i = 0; i < 100 && Audited(method, words).empty(); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    return Audited(method, words);
  }
};

TEST_F(DaemonLimitsTest, MessagesAreTakenUncompressedAlone) {
  StartDaemon();
  for (const char* name : {"modest", "greedy"}) {
    for (const auto algorithm : {GRPC_COMPRESS_GZIP, GRPC_COMPRESS_DEFLATE}) {
      grpc::ClientContext context;
      context.set_compression_algorithm(algorithm);
      v1::GetJobRequest request;
      request.set_job_id(std::string(2000, 'x'));
      v1::Job job;
      const grpc::Status status = v1::Jobs::NewStub(ClientNamed(name))->GetJob(&context, request, &job);
      EXPECT_EQ(status.error_code(), grpc::StatusCode::UNIMPLEMENTED) << status.error_message();
      EXPECT_THAT(status.error_message(), HasSubstr("weftd takes identity alone"));
    }
    EXPECT_TRUE(Ask(ClientNamed(name)).ok());
  }
}

TEST_F(DaemonLimitsTest, CallsWithLargeHeadersAreRefusedAndNamed) {
  StartDaemon();
  const auto with = [this](size_t bytes) {
    grpc::ClientContext context;
    context.AddMetadata("x-large", std::string(bytes, 'x'));
    v1::ServerInfo info;
    return v1::Server::NewStub(client_->channel())->GetServerInfo(&context, {}, &info);
  };
  EXPECT_TRUE(with(15'000).ok());
  const grpc::Status refused = with(16'384);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(refused.error_message(), StartsWith("the call's metadata has 16"));
  EXPECT_THAT(refused.error_message(), HasSubstr(" bytes, at most 16384 are allowed"));
  const std::vector<v1::AuditEntry> entries = WaitUntilAudited("Server.GetServerInfo", "metadata");
  ASSERT_EQ(entries.size(), 1U);
  EXPECT_EQ(entries[0].outcome(), "INVALID_ARGUMENT");
  EXPECT_THAT(entries[0].peer(), StartsWith("user "));
  EXPECT_EQ(entries[0].message(), refused.error_message());
  EXPECT_EQ(entries[0].caller(), "") << "nobody looked who it is";
  // What every call has beside its own.
  const std::vector<std::string> words = absl::StrSplit(refused.error_message(), ' ');
  const size_t others = std::stoul(words.at(4)) - 16'384;
  EXPECT_TRUE(with(16'384 - others).ok());
  EXPECT_THAT(with(16'385 - others).error_message(), StartsWith("the call's metadata has 16385 bytes"));
}

TEST_F(DaemonLimitsTest, IdleWatchersOfOneCallerLeaveRoomForOthers) {
  options_.caller_limits.streams = 5;
  StartDaemon();
  const std::string id = Submit({"hang"});
  const auto greedy = v1::Jobs::NewStub(ClientNamed("greedy")),
             modest = v1::Jobs::NewStub(ClientNamed("modest"));
  v1::WatchJobRequest request;
  request.set_job_id(id);
  v1::JobUpdate update;
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::ClientReader<v1::JobUpdate>>> streams;
  const auto watch = [&](v1::Jobs::Stub& stub) {
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    streams.push_back(stub.WatchJob(contexts.back().get(), request));
    return streams.back()->Read(&update);
  };
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(watch(*greedy));
  EXPECT_FALSE(watch(*greedy));
  const grpc::Status refused = streams.back()->Finish();
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(refused.error_message(), HasSubstr("has 5 streams open, the most at once"));
  EXPECT_TRUE(RetryAfter(refused.error_message()).has_value());
  EXPECT_TRUE(watch(*modest));
  // One that goes makes room.
  contexts[0]->TryCancel();
  bool admitted = false;
  for (int i = 0; i < 100 && !admitted; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    admitted = watch(*greedy);
  }
  EXPECT_TRUE(admitted);
  for (const auto& context : contexts) context->TryCancel();
  ASSERT_TRUE(client_->Cancel(id).ok());
}

TEST_F(DaemonLimitsTest, AFloodOfOneCallerIsRefusedAndWhoObeysIsServed) {
  options_.caller_limits.calls_per_s = 50;
  options_.caller_limits.burst = 10;
  StartDaemon();
  const std::shared_ptr<grpc::Channel> greedy = ClientNamed("greedy"), modest = ClientNamed("modest");
  int refused = 0;
  for (int i = 0; i < 200; ++i) {
    const grpc::Status status = Ask(greedy);
    if (status.ok()) continue;
    ASSERT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << status.error_message();
    ASSERT_TRUE(RetryAfter(status.error_message()).has_value()) << status.error_message();
    ++refused;
  }
  EXPECT_GT(refused, 50);
  EXPECT_TRUE(Ask(modest).ok());
  EXPECT_EQ(WaitUntilAudited("Server.GetServerInfo", "makes more than 50 calls per second").empty(), false);
  // Our own client waits as it is told.
  for (int i = 0; i < 40; ++i) EXPECT_TRUE(client_->List(1).ok());
}

TEST_F(DaemonLimitsTest, OneCallerCannotFillTheQueueOfJobs) {
  options_.caller_limits.jobs = 3;
  StartDaemon();
  const auto greedy = v1::Jobs::NewStub(ClientNamed("greedy"));
  const auto submit = [&](int i) {
    grpc::ClientContext context;
    v1::Job job;
    const v1::SubmitJobRequest request = MakeRequest({"hang"}, "greedy" + std::to_string(i));
    grpc::Status status = greedy->SubmitJob(&context, request, &job);
    EXPECT_EQ(status.ok(), job.submitted_by().find("(greedy)") != std::string::npos);
    return status;
  };
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(submit(i).ok());
  const grpc::Status refused = submit(3);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(refused.error_message(), HasSubstr("3 unfinished jobs, the most of one caller"));
  EXPECT_TRUE(RetryAfter(refused.error_message()).has_value());
  EXPECT_FALSE(Submit({"a"}, "of_modest").empty());
  const std::vector<v1::Job> jobs = client_->List(10).value();
  for (const v1::Job& job : jobs) EXPECT_TRUE(client_->Cancel(job.id()).ok());
}

TEST_F(DaemonLimitsTest, TheAuditLogTellsWhoDidWhat) {
  StartDaemon();
  const std::string id = Submit({"a"});
  WaitForEnd(id);
  const std::vector<v1::AuditEntry> submitted = WaitUntilAudited("Jobs.SubmitJob");
  ASSERT_EQ(submitted.size(), 1U);
  EXPECT_THAT(submitted[0].caller(), StartsWith("user "));
  EXPECT_EQ(submitted[0].peer(), submitted[0].caller());
  EXPECT_EQ(submitted[0].outcome(), "OK");
  EXPECT_EQ(submitted[0].about().at("id"), id);
  EXPECT_EQ(submitted[0].about().at("spec.out"), folder_ / "out");
  // What failed, with its reason.
  EXPECT_FALSE(client_->Cancel("no-such-job").ok());
  const std::vector<v1::AuditEntry> failed = WaitUntilAudited("Jobs.CancelJob");
  ASSERT_EQ(failed.size(), 1U);
  EXPECT_EQ(failed[0].outcome(), "NOT_FOUND");
  EXPECT_EQ(failed[0].about().at("job_id"), "no-such-job");
  // Looking is not recorded.
  EXPECT_TRUE(Audited("Jobs.WatchJob").empty());
}

TEST_F(DaemonLimitsTest, TheAuditLogNamesWhoConnectsAndAsksForNothing) {
  StartDaemon();
  const sockaddr_in address = Address();
  client_.reset();
  {
    const UniqueFd socket(::socket(AF_INET, SOCK_STREAM, 0));
    ASSERT_EQ(connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    // The kernel knows whose an open connection is.
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
  }
  const std::vector<v1::AuditEntry> entries = WaitUntilAudited("", "ended without a call");
  ASSERT_FALSE(entries.empty());
  EXPECT_EQ(entries[0].times(), 1);
  EXPECT_THAT(entries[0].peer(), StartsWith("user "));
}

// CVE-2023-1428: gRPC 1.51 aborts, before anybody has shown a token.
TEST_F(DaemonLimitsTest, OutlivesHeadersBeyondTheLimitOfGrpc) {
  StartDaemon();
  const auto literal = [](const std::string& name, const std::string& value) {
    // Without indexing or Huffman (RFC 7541, 6.2.2); a value of 127 bytes and more has two bytes of length
    // here.
    std::string length(1, static_cast<char>(std::min<size_t>(value.size(), 127)));
    if (value.size() >= 127) {
      length += static_cast<char>((value.size() - 127) % 128 + 128);
      length += static_cast<char>((value.size() - 127) / 128);
    }
    return std::string(1, '\0') + static_cast<char>(name.size()) + name + length + value;
  };
  for (const auto& [name, value] : std::map<std::string, std::string>{
           {"grpclb_client_stats", "x"}, {"te", "x"}, {":scheme", "x"}, {"lb-cost-bin", "AAAA"}}) {
    const std::string headers = literal(":method", "POST") + literal(":path", "/weft.v1.Jobs/ListJobs") +
                                literal(name, value) + literal("zz", std::string(15'000, 'b'));
    std::string bytes = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + std::string("\0\0\0\4\0\0\0\0\0", 9);
    bytes += std::string(1, '\0') + static_cast<char>(headers.size() / 256) +
             static_cast<char>(headers.size() % 256);
    bytes += std::string("\1\5\0\0\0\1", 6) + headers;
    const sockaddr_in address = Address();
    const UniqueFd socket(::socket(AF_INET, SOCK_STREAM, 0));
    ASSERT_EQ(connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    ASSERT_EQ(send(socket.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(bytes.size()));
    // Its answer, or its end.
    const timeval patience = {2, 0};
    setsockopt(socket.get(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    char answer[4096];
    for (int reads = 0; reads < 4 && recv(socket.get(), answer, sizeof answer, 0) > 0; ++reads) {
    }
    EXPECT_TRUE(client_->List(1).ok()) << name;
  }
}

// CVE-2023-33953: gRPC 1.51 keeps all of it.
TEST_F(DaemonLimitsTest, EndsAConnectionWhoseHeadersDoNotEnd) {
  StartDaemon();
  const sockaddr_in address = Address();
  const UniqueFd socket(::socket(AF_INET, SOCK_STREAM, 0));
  ASSERT_EQ(connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  // The preface, empty SETTINGS, HEADERS without an end, and the same CONTINUATION again and again (RFC
  // 9113).
  std::string bytes = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
  bytes += std::string("\0\0\0\4\0\0\0\0\0", 9) + std::string("\0\0\1\1\0\0\0\0\1\x83", 10);
  ASSERT_GT(send(socket.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL), 0);
  std::string piece = std::string("\0\x3e\x80\x9\0\0\0\0\1", 9);
  piece += std::string("\0\1a\x7f\xfe\x7c", 6) + std::string(16000 - 6, 'b');  // a value of 16,125 bytes
  size_t sent = 0;
  constexpr size_t kFarTooMuch = size_t{1} << 30;  // the guard looks every 50 ms
  while (sent < kFarTooMuch) {
    const ssize_t n = send(socket.get(), piece.data(), piece.size(), MSG_NOSIGNAL);
    if (n <= 0) break;
    sent += static_cast<size_t>(n);
  }
  EXPECT_LT(sent, kFarTooMuch);
  EXPECT_TRUE(client_->List(1).ok());
  EXPECT_FALSE(WaitUntilAudited("", "sent more than was heard of it").empty());
}

}  // namespace
}  // namespace weft
