// What a daemon says of itself: health and metrics.
#include <arpa/inet.h>
#include <fcntl.h>
#include <grpcpp/grpcpp.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <set>
#include <sstream>
#include <thread>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "services/formats/files/json_file.h"
#include "services/ground/process/unique_fd.h"
#include "services/server/access/access_list.h"
#include "services/server/access/audit_log.h"
#include "services/studio/recorder/recorder_files.h"
#include "tests/services/server/access/certificate_maker.h"
#include "tests/services/server/daemon/daemon_fixture.h"
#include "tests/services/server/daemon/raw_call.h"
#include "weft/v1/recorder.pb.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

class HealthTest : public DaemonTest {
 protected:
  bool IsServing(const std::string& service = "") {
    return AskHealth(daemon_->address(), service) == "SERVING";
  }
  bool WaitUntil(bool serving) {
    for (int i = 0; i < 100; ++i) {
      if (IsServing() == serving) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    return false;
  }
};

TEST_F(HealthTest, SaysNotServingWhileNothingCanBeWrittenDown) {
  signal(SIGXFSZ, SIG_IGN);
  StartDaemon();
  EXPECT_TRUE(IsServing());
  EXPECT_TRUE(IsServing("weft.v1.Jobs"));
  const std::string id = Submit({"hang"});
  WatchUntilRunning(id);
  // The worker runs without the limit.
  rlimit before = {};
  getrlimit(RLIMIT_FSIZE, &before);
  rlimit full = before;
  full.rlim_cur = 1;
  setrlimit(RLIMIT_FSIZE, &full);
  // Waits until its end is written down.
  std::jthread cancelling([&] { EXPECT_TRUE(client_->Cancel(id).ok()); });
  const bool said = WaitUntil(false);
  const std::string of_jobs = AskHealth(daemon_->address(), "weft.v1.Jobs");
  setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_TRUE(said);
  EXPECT_EQ(of_jobs, "NOT_SERVING");
  EXPECT_TRUE(WaitUntil(true));
  EXPECT_EQ(WaitForEnd(id).state(), v1::JOB_STATE_CANCELLED);
}

// More often than the calls that one caller may have open at once.
TEST_F(HealthTest, MayBeAskedAgainAndAgain) {
  StartDaemon();
  for (int i = 0; i < 60; ++i) ASSERT_TRUE(IsServing()) << i;
}

class MetricsTest : public DaemonTest {
 protected:
  MetricsTest() {
    options_.metrics_listen = "127.0.0.1:0";
    std::filesystem::create_directories(options_.state_folder);
    token_ = AddToken(AccessListFile(options_.state_folder), {"prometheus", v1::ROLE_VIEWER}).value().text;
  }
  std::string Get(const std::string& path, const std::string& token) {
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const std::string& text = daemon_->metrics_address();
    address.sin_port = htons(static_cast<uint16_t>(std::stoi(text.substr(text.rfind(':') + 1))));
    const UniqueFd connection(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    EXPECT_EQ(connect(connection.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    const std::string request =
        absl::StrCat("GET ", path, " HTTP/1.1\r\nHost: ", text, "\r\nConnection: close\r\n",
                     token.empty() ? "" : "Authorization: Bearer " + token + "\r\n", "\r\n");
    EXPECT_EQ(send(connection.get(), request.data(), request.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(request.size()));
    std::string answer;
    char bytes[4096];
    for (ssize_t n = 0; (n = recv(connection.get(), bytes, sizeof bytes, 0)) > 0;)
      answer.append(bytes, static_cast<size_t>(n));
    return answer;
  }
  // Of a line "NAME{LABELS} VALUE"; -1: there is none.
  static double ValueOfMetric(const std::string& text, const std::string& name) {
    for (const absl::string_view line : absl::StrSplit(text, '\n')) {
      if (absl::StartsWith(line, name + " ")) return std::stod(std::string(line.substr(name.size() + 1)));
    }
    return -1;
  }

  // The page as soon as it counts so many: a call is counted after its answer was sent.
  std::string PageWith(const std::string& name, double least) {
    std::string text = Get("/metrics", token_);
    for (int i = 0; i < 200 && ValueOfMetric(text, name) < least; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
      text = Get("/metrics", token_);
    }
    return text;
  }

  std::string token_;
};

TEST_F(MetricsTest, CountCallsJobsAndFrames) {
  StartDaemon();
  WaitForEnd(Submit({"a", "b", "crash"}));
  EXPECT_FALSE(client_->Cancel("no-such-job").ok());
  const std::string cancelled = "weft_calls_total{method=\"Jobs.CancelJob\",outcome=\"NOT_FOUND\"}";
  std::string text = PageWith(cancelled, 1);
  EXPECT_THAT(text, StartsWith("HTTP/1.1 200"));
  EXPECT_EQ(ValueOfMetric(text, "weft_calls_total{method=\"Jobs.SubmitJob\",outcome=\"OK\"}"), 1);
  EXPECT_EQ(ValueOfMetric(text, cancelled), 1);
  EXPECT_EQ(ValueOfMetric(text, "weft_call_seconds_count{method=\"Jobs.SubmitJob\"}"), 1);
  EXPECT_EQ(ValueOfMetric(text, "weft_frames_total{outcome=\"done\"}"), 2);
  EXPECT_EQ(ValueOfMetric(text, "weft_frames_total{outcome=\"failed\"}"), 1);
  EXPECT_EQ(ValueOfMetric(text, "weft_jobs{state=\"running\"}"), 0);
  EXPECT_EQ(ValueOfMetric(text, "weft_serving"), 1);
  EXPECT_EQ(ValueOfMetric(text, "weft_connections"), 1);
  EXPECT_GT(ValueOfMetric(text, "process_resident_memory_bytes"), 1e6);
  EXPECT_GT(ValueOfMetric(text, "weft_state_free_bytes"), 0);
  EXPECT_GT(ValueOfMetric(text, "process_start_time_seconds"), 1.7e9);
  // Counters do not count twice.
  text = Get("/metrics", token_);
  EXPECT_EQ(ValueOfMetric(text, "weft_frames_total{outcome=\"done\"}"), 2);
}

TEST_F(MetricsTest, TellOfTakesThatAreRecorded) {
  // This process stands in for the recorder of one; the other one has ended.
  std::vector<UniqueFd> locks;
  for (const char* id : {"20260101-000000-00000000", "20260101-000000-00000001"}) {
    const std::string folder = folder_ / (std::string("state/takes/") + id);
    std::filesystem::create_directories(folder);
    const RecorderFiles files(folder);
    v1::RecorderState state;
    state.set_phase(locks.empty() ? v1::RECORDER_PHASE_RECORDING : v1::RECORDER_PHASE_ENDED);
    state.set_sets_dropped(3);
    state.set_frames_missing(5);
    ASSERT_TRUE(WriteJsonFile(files.request, v1::RecorderRequest()).ok());
    ASSERT_TRUE(WriteJsonFile(files.state, state).ok());
    if (!locks.empty()) continue;
    WriteBytes(files.lock, std::to_string(getpid()));
    locks.emplace_back(open(files.lock.c_str(), O_RDWR | O_CLOEXEC));
    ASSERT_EQ(flock(locks[0].get(), LOCK_EX | LOCK_NB), 0);
  }
  StartDaemon();
  const std::string text = Get("/metrics", token_);
  EXPECT_EQ(ValueOfMetric(text, "weft_takes_recording"), 1);
  EXPECT_EQ(ValueOfMetric(text, "weft_recording_sets_dropped"), 3);
  EXPECT_EQ(ValueOfMetric(text, "weft_recording_frames_missing"), 5);
}

TEST_F(MetricsTest, AreForThoseWhoShowAToken) {
  StartDaemon();
  for (const char* token : {"", "wrong"}) {
    const std::string refused = Get("/metrics", token);
    EXPECT_THAT(refused, StartsWith("HTTP/1.1 401")) << token;
    EXPECT_THAT(refused, Not(HasSubstr("weft_jobs")));
  }
  EXPECT_THAT(Get("/elsewhere", token_), StartsWith("HTTP/1.1 404"));
  daemon_->Stop();
  const std::vector<v1::AuditEntry> log = ReadAuditLog(AuditLogFile(options_.state_folder), 100).value();
  EXPECT_TRUE(std::any_of(log.begin(), log.end(), [](const v1::AuditEntry& entry) {
    return entry.method() == "GET /metrics" && entry.peer() == "127.0.0.1";
  }));
}

TEST_F(MetricsTest, KeepNamesOfClientsMakingApart) {
  StartDaemon();
  WaitForEnd(Submit({"a"}));
  for (int i = 0; i < 5; ++i) AskHealth(daemon_->address(), "");
  const std::string others = "weft_calls_total{method=\"other\",outcome=\"OK\"}";
  const std::string text = PageWith(others, 5);
  EXPECT_GE(ValueOfMetric(text, others), 5);
  EXPECT_THAT(text, Not(HasSubstr("grpc.health")));
}

TEST_F(MetricsTest, AskForTlsBeyondThisMachine) {
  options_.metrics_listen = "0.0.0.0:0";
  const auto daemon = Daemon::Start(options_);
  EXPECT_EQ(daemon.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(daemon.status().message()), HasSubstr("--metrics: 0.0.0.0:0"));
  CertificateMaker maker(folder_.path(), "studio");
  const CertificateFiles server = maker.Sign("weftd");
  options_.tls = {server.certificate, server.key, "", ""};
  StartDaemon();
  EXPECT_THAT(Get("/metrics", token_), Not(HasSubstr("200")));  // plain HTTP
}

// The dashboard shows nothing that is not there.
TEST_F(MetricsTest, HaveAllThatTheDashboardAsksFor) {
  StartDaemon();
  WaitForEnd(Submit({"a"}));
  const std::string text = Get("/metrics", token_);
  std::ifstream file(WEFT_DASHBOARD);
  std::stringstream dashboard;
  dashboard << file.rdbuf();
  std::set<std::string> names;
  const std::string all = dashboard.str();
  for (const char* prefix : {"weft_", "process_"}) {
    for (size_t at = all.find(prefix); at != std::string::npos; at = all.find(prefix, at + 1))
      names.insert(all.substr(at, all.find_first_not_of("abcdefghijklmnopqrstuvwxyz_", at) - at));
  }
  EXPECT_GT(names.size(), 10U);
  for (const std::string& name : names)
    EXPECT_TRUE(absl::StrContains(text, "\n" + name + "{") || absl::StrContains(text, "\n" + name + " "))
        << name;
}

}  // namespace
}  // namespace weft
