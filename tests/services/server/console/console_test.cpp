// The console of a daemon, asked byte by byte.
#include "services/server/console/console.h"

#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <filesystem>
#include <thread>

#include "absl/strings/str_cat.h"
#include "services/formats/files/mesh_file.h"
#include "services/ground/process/unique_fd.h"
#include "services/server/access/access_list.h"
#include "services/server/access/audit_log.h"
#include "services/server/console/json_messages.h"
#include "tests/services/server/daemon/daemon_fixture.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

class ConsoleTest : public DaemonTest {
 protected:
  ConsoleTest() {
    options_.console_listen = "127.0.0.1:0";
    StartDaemon();
    const std::string& address = daemon_->console_address();
    port_ = std::stoi(address.substr(address.rfind(':') + 1));
  }
  std::string TokenOf(v1::Role role) {
    const std::string text = AddToken(AccessListFile(options_.state_folder), {"anna", role, 0}).value().text;
    // A daemon that runs takes the change within a second.
    std::this_thread::sleep_for(std::chrono::milliseconds(700));
    return text;
  }
  UniqueFd Connect() const {
    UniqueFd connection(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<uint16_t>(port_));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const timeval patience = {20, 0};
    setsockopt(connection.get(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    EXPECT_EQ(connect(connection.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    return connection;
  }
  static void Send(const UniqueFd& connection, const std::string& bytes) {
    (void)send(connection.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
  }
  // Until `end` was read, or the other side ended it.
  static std::string Receive(const UniqueFd& connection, const std::string& end = "") {
    std::string all;
    char bytes[4096];
    while (end.empty() || all.find(end) == std::string::npos) {
      const ssize_t n = recv(connection.get(), bytes, sizeof bytes, 0);
      if (n <= 0) break;
      all.append(bytes, static_cast<size_t>(n));
    }
    return all;
  }
  std::string Ask(const std::string& request) const {
    const UniqueFd connection = Connect();
    Send(connection, request);
    return Receive(connection);
  }
  std::string Headers(const std::string& more = "") const {
    return absl::StrCat("Host: 127.0.0.1:", port_, "\r\nConnection: close\r\n",
                        cookie_.empty() ? "" : absl::StrCat("Cookie: ", cookie_, "\r\n"), more);
  }
  std::string Origin() const { return absl::StrCat("Origin: http://127.0.0.1:", port_, "\r\n"); }
  std::string Get(const std::string& path, const std::string& more = "") const {
    return Ask(absl::StrCat("GET ", path, " HTTP/1.1\r\n", Headers(more), "\r\n"));
  }
  std::string Post(const std::string& path, const std::string& body) const {
    return Ask(absl::StrCat("POST ", path, " HTTP/1.1\r\n", Headers(Origin()),
                            "Content-Type: application/json\r\nContent-Length: ", body.size(), "\r\n\r\n",
                            body));
  }
  std::string LogIn(const std::string& token) {
    const std::string answer = Post("/login", absl::StrCat("{\"token\": \"", token, "\"}"));
    const size_t at = answer.find("Set-Cookie: ");
    if (at != std::string::npos) cookie_ = answer.substr(at + 12, answer.find(';', at) - at - 12);
    return answer;
  }

  int port_ = 0;
  std::string cookie_;
};

TEST_F(ConsoleTest, ExchangesATokenForACookieThatScriptsCannotRead) {
  EXPECT_THAT(Post("/api/Server/GetServerInfo", "{}"), StartsWith("HTTP/1.1 401"));
  EXPECT_THAT(LogIn("weft_wrong"), StartsWith("HTTP/1.1 401"));
  const std::string token = TokenOf(v1::ROLE_VIEWER);
  const std::string answer = LogIn(token);
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(answer, HasSubstr("; HttpOnly; SameSite=Strict;"));
  EXPECT_THAT(answer, HasSubstr("ROLE_VIEWER"));
  EXPECT_THAT(answer, Not(HasSubstr(token)));
  EXPECT_THAT(Get("/session"), HasSubstr("(anna)"));
  EXPECT_THAT(Post("/api/Server/GetServerInfo", "{}"), HasSubstr("\"workers\":1"));
  EXPECT_THAT(Post("/logout", "{}"), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(Get("/session"), StartsWith("HTTP/1.1 401"));
}

// Roles, errors with their fields and the audit log are those of the API.
// A parser would take 300 bytes for each of these, of browsers that nobody knows.
TEST_F(ConsoleTest, JsonThatIsMadeToTakeMemoryIsRefusedUnread) {
  const std::string nested = "{\"token\":" + std::string(1'000'000, '[');
  std::string many = "{\"token\":[";
  for (int i = 0; i < 300'000; ++i) many += "{},";
  v1::ConsoleLogin login;
  EXPECT_THAT(std::string(FromJson(nested, login).message()), HasSubstr("deeper than that"));
  EXPECT_THAT(std::string(FromJson(many + "{}]}", login).message()), HasSubstr("20000 at most"));
  EXPECT_THAT(Post("/login", nested), StartsWith("HTTP/1.1 400"));
  ASSERT_THAT(LogIn(TokenOf(v1::ROLE_VIEWER)), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(Post("/api/Jobs/GetJob", nested), HasSubstr("deeper than that"));
}

TEST_F(ConsoleTest, CallsAreThoseOfTheTokensOwner) {
  LogIn(TokenOf(v1::ROLE_VIEWER));
  const std::string refused = Post("/api/Takes/StartTake", "{}");
  EXPECT_THAT(refused, StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(refused, HasSubstr("asks for the role operator"));
  EXPECT_THAT(Post("/api/Jobs/GetJob", "{\"jobId\": \"none\"}"), StartsWith("HTTP/1.1 404"));
  EXPECT_THAT(Post("/api/Jobs/GetJob", "{\"nothing\": 1}"), StartsWith("HTTP/1.1 400"));
  EXPECT_THAT(Post("/api/Jobs/GetJob", std::string(2000, '[')), StartsWith("HTTP/1.1 400"));
  EXPECT_THAT(Post("/api/Jobs/WatchJob", "{}"), StartsWith("HTTP/1.1 404"));
  EXPECT_THAT(Post("/api/Nothing/Here", "{}"), StartsWith("HTTP/1.1 404"));
  LogIn(TokenOf(v1::ROLE_CLIENT));
  EXPECT_THAT(Post("/api/Jobs/SubmitJob", "{\"spec\": {\"dump\": \"/nowhere\"}}"), HasSubstr("spec."));
  // Calls are recorded after they are answered.
  const auto is_recorded = [&] {
    const auto entries = ReadAuditLog(AuditLogFile(options_.state_folder), 100).value();
    return std::any_of(entries.begin(), entries.end(), [](const v1::AuditEntry& entry) {
      return entry.peer() == "127.0.0.1 (console)" && entry.method() == "Jobs.SubmitJob" &&
             entry.caller().find("anna") != std::string::npos;
    });
  };
  for (int i = 0; i < 100 && !is_recorded(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_TRUE(is_recorded());
}

TEST_F(ConsoleTest, RefusesOtherSites) {
  LogIn(TokenOf(v1::ROLE_ADMIN));
  const std::string host = absl::StrCat("Host: 127.0.0.1:", port_, "\r\n");
  const std::string tail = absl::StrCat("Connection: close\r\nCookie: ", cookie_,
                                        "\r\nContent-Type: application/json\r\nContent-Length: 2\r\n\r\n{}");
  const std::string post = "POST /api/Server/Drain HTTP/1.1\r\n";
  for (const std::string& origin :
       {std::string("Origin: http://evil.example\r\n"), std::string("Origin: null\r\n"), std::string(),
        absl::StrCat("Origin: https://127.0.0.1:", port_ + 1, "\r\n"),
        absl::StrCat("Origin: ftp://127.0.0.1:", port_, "\r\n")})
    EXPECT_THAT(Ask(post + host + origin + tail), StartsWith("HTTP/1.1 403")) << origin;
  EXPECT_THAT(Ask(post + host + Origin() + "Sec-Fetch-Site: cross-site\r\n" + tail),
              StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(Ask(post + "Host: evil.example\r\nOrigin: http://evil.example\r\n" + tail),
              StartsWith("HTTP/1.1 421"));
  EXPECT_THAT(Get("/session", "Sec-Fetch-Site: same-site\r\n"), StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(Get("/session", "Sec-Fetch-Site: same-origin\r\n"), StartsWith("HTTP/1.1 200"));
  const std::string form = absl::StrCat("POST /api/Jobs/ListJobs HTTP/1.1\r\n", Headers(Origin()),
                                        "Content-Type: text/plain\r\nContent-Length: 2\r\n\r\n{}");
  EXPECT_THAT(Ask(form), StartsWith("HTTP/1.1 415"));
  EXPECT_THAT(Get("/session"), HasSubstr("default-src 'none'"));
}

// nginx and others end TLS and ask in plain HTTP, by the browser's Host or by an address of their own.
TEST_F(ConsoleTest, AnswersThroughAProxyThatEndsTls) {
  const std::string token = TokenOf(v1::ROLE_VIEWER);
  const std::string body = absl::StrCat("{\"token\": \"", token, "\"}");
  const auto log_in = [&](const std::string& host, const std::string& more) {
    return Ask(absl::StrCat("POST /login HTTP/1.1\r\nHost: ", host, "\r\nConnection: close\r\n", more,
                            "Origin: https://localhost:8443\r\nContent-Type: application/json\r\n"
                            "Content-Length: ",
                            body.size(), "\r\n\r\n", body));
  };
  const std::string own = absl::StrCat("127.0.0.1:", port_);
  EXPECT_THAT(log_in("localhost:8443", ""), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(log_in(own, ""), StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(log_in(own, "X-Forwarded-Host: evil.example\r\n"), StartsWith("HTTP/1.1 421"));
  const std::string answer = log_in(own, "X-Forwarded-Host: localhost:8443\r\nX-Forwarded-Proto: https\r\n");
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(answer, HasSubstr("Set-Cookie: __Host-weft_"));
  EXPECT_THAT(answer, HasSubstr("; Secure"));
}

TEST_F(ConsoleTest, OutlivesWhatIsNoRequest) {
  for (const std::string& bytes :
       {std::string("\r\n\r\n"), std::string("GET\r\n\r\n"), std::string("\x16\x03\x01\x02", 4) + "\r\n\r\n",
        "GET /" + std::string(100'000, 'a') + " HTTP/1.1\r\n\r\n",
        "GET / HTTP/1.1\r\nHost: localhost\r\nX: " + std::string(100'000, 'b') + "\r\n\r\n",
        absl::StrCat("POST /login HTTP/1.1\r\n", Headers(Origin()),
                     "Content-Type: application/json\r\nContent-Length: 99999999999\r\n\r\n{")}) {
    const UniqueFd connection = Connect();
    Send(connection, bytes);
    shutdown(connection.get(), SHUT_WR);
    EXPECT_THAT(Receive(connection), Not(StartsWith("HTTP/1.1 200")));
  }
  EXPECT_THAT(LogIn(TokenOf(v1::ROLE_VIEWER)), StartsWith("HTTP/1.1 200"));
}

// Roles and errors are those of FetchResult, whose bytes they come from.
TEST_F(ConsoleTest, MeshesAreSentToBeDrawn) {
  EXPECT_THAT(Get("/mesh/any/0000"), StartsWith("HTTP/1.1 401"));
  LogIn(TokenOf(v1::ROLE_VIEWER));
  const std::string id = client_->Submit(MakeRequest({"a", "b"})).value().id();
  EXPECT_EQ(WaitForEnd(id).state(), v1::JOB_STATE_DONE);
  RegisteredMesh mesh;
  mesh.vertices_mm = {{0, 0, 900}, {100, 0, 900}, {0, 100, 900}};
  mesh.state = {VertexState::kObserved, VertexState::kTwoView, VertexState::kInferred};
  mesh.sigma_mm = {0.1f, 0.2f, 0.3f};
  mesh.views = {3, 2, 0};
  std::filesystem::create_directories(folder_ / "out/a");
  ASSERT_TRUE(WriteRegisteredMesh(folder_ / "out/a/mesh.ply", mesh, {{0, 1, 2}}).ok());
  const std::string plain = Get(absl::StrCat("/mesh/", id, "/a"));
  EXPECT_THAT(plain, StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(plain, HasSubstr("weftmsh1"));
  EXPECT_GT(Get(absl::StrCat("/mesh/", id, "/a?faces=1")).size(), plain.size());
  const std::string none = Get(absl::StrCat("/mesh/", id, "/b"));
  EXPECT_THAT(none, StartsWith("HTTP/1.1 404"));
  EXPECT_THAT(none, HasSubstr("no mesh.ply; is it finished?"));
  WriteBytes(folder_ / "out/b/mesh.ply", "ply\nformat ascii 1.0\nend_header\n");
  EXPECT_THAT(Get(absl::StrCat("/mesh/", id, "/b")), HasSubstr("register the frame again"));
  for (const char* wrong : {"/mesh/a", "/mesh/none/a", "/mesh/a/b/c"})
    EXPECT_THAT(Get(wrong), StartsWith("HTTP/1.1 404")) << wrong;
}

// A frame of a client (RFC 6455, 5.2), masked with zeros.
std::string Frame(const std::string& text) {
  std::string frame = "\x81";
  frame.push_back(static_cast<char>(0x80 | text.size()));
  return frame + std::string(4, '\0') + text;
}

TEST_F(ConsoleTest, StreamsComeOverOneSocket) {
  LogIn(TokenOf(v1::ROLE_CLIENT));
  const absl::StatusOr<v1::Job> job = client_->Submit(MakeRequest({"slow_0001", "slow_0002"}));
  ASSERT_TRUE(job.ok()) << job.status();
  const UniqueFd connection = Connect();
  const std::string upgrade =
      absl::StrCat("Host: 127.0.0.1:", port_, "\r\nCookie: ", cookie_,
                   "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                   "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n");
  EXPECT_THAT(Ask("GET /live HTTP/1.1\r\n" + upgrade + "\r\n"), StartsWith("HTTP/1.1 403"));
  Send(connection, "GET /live HTTP/1.1\r\n" + upgrade + Origin() + "\r\n");
  EXPECT_THAT(Receive(connection, "0 alive"), StartsWith("HTTP/1.1 101"));
  Send(connection, Frame(absl::StrCat("5 Jobs.WatchJob\n{\"jobId\": \"", job->id(), "\"}")));
  EXPECT_THAT(Receive(connection, "5 end"), HasSubstr("5 message\n"));
  Send(connection, Frame("6 Jobs.WatchJob\n{\"jobId\": \"none\"}"));
  EXPECT_THAT(Receive(connection, "NOT_FOUND"), HasSubstr("6 end"));
  Send(connection, Frame("no order"));
  EXPECT_THAT(Receive(connection, "INVALID_ARGUMENT"), HasSubstr("0 end"));
}

TEST_F(ConsoleTest, EndsWithItsDaemonWhilePagesWatch) {
  LogIn(TokenOf(v1::ROLE_CLIENT));
  const UniqueFd connection = Connect();
  Send(connection, "GET /session HTTP/1.1\r\n");  // and no end
  daemon_.reset();
  EXPECT_EQ(Receive(connection), "");
}

}  // namespace
}  // namespace weft
