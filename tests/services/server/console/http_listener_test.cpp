// The HTTP listener, asked byte by byte.
#include "services/server/console/http_listener.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <fstream>

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

class HttpListenerTest : public ::testing::Test {
 protected:
  void Start(HttpListenerOptions options = {}) {
    options.tokens_vouch = true;
    UniqueFd listening(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    address_.sin_family = AF_INET;
    address_.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t bytes = sizeof address_;
    ASSERT_EQ(bind(listening.get(), reinterpret_cast<sockaddr*>(&address_), bytes), 0);
    ASSERT_EQ(listen(listening.get(), 64), 0);
    ASSERT_EQ(getsockname(listening.get(), reinterpret_cast<sockaddr*>(&address_), &bytes), 0);
    auto listener = HttpListener::Start(
        std::move(listening), std::move(options), HttpListener::Answering([this](HttpExchange& exchange) {
          ++asked_;
          const std::string token = BearerOf(exchange.Header("Authorization"));
          return HttpReply{200, "text/plain",
                           exchange.target.path + " token=" + token + " of " + exchange.peer};
        }));
    ASSERT_TRUE(listener.ok()) << listener.status();
    listener_ = *std::move(listener);
  }
  UniqueFd Connect() {
    UniqueFd connection(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    EXPECT_EQ(connect(connection.get(), reinterpret_cast<const sockaddr*>(&address_), sizeof address_), 0);
    return connection;
  }
  // All bytes of the answer, until the server closes.
  static std::string Exchange(const UniqueFd& connection, const std::string& request) {
    if (!request.empty()) {
      EXPECT_EQ(send(connection.get(), request.data(), request.size(), MSG_NOSIGNAL),
                static_cast<ssize_t>(request.size()));
    }
    std::string answer;
    char bytes[4096];
    for (ssize_t n = 0; (n = recv(connection.get(), bytes, sizeof bytes, 0)) > 0;)
      answer.append(bytes, static_cast<size_t>(n));
    return answer;
  }
  std::string Ask(const std::string& request) { return Exchange(Connect(), request); }
  std::string Get(const std::string& headers) {
    return Ask("GET /metrics?x=1 HTTP/1.1\r\n" + headers + "Connection: close\r\n\r\n");
  }

  sockaddr_in address_ = {};
  std::atomic<int> asked_ = 0;
  std::unique_ptr<HttpListener> listener_;
};

TEST_F(HttpListenerTest, AnswersWhoAsksByAddress) {
  Start();
  const std::string answer = Get("Host: 127.0.0.1:9\r\nAuthorization: Bearer abc\r\n");
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(answer, HasSubstr("/metrics token=abc of 127.0.0.1"));
  EXPECT_THAT(Get("Host: [::1]:9\r\n"), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(Get("Host: LOCALHOST\r\n"), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(Ask("HEAD /a HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"),
              StartsWith("HTTP/1.1 200"));
}

// Prometheus asks by whatever name it was given. No page of a foreign site can show a token.
TEST_F(HttpListenerTest, AnswersWhoShowsATokenUnderAnyName) {
  Start();
  EXPECT_THAT(Get("Host: weft.studio.example:9411\r\nAuthorization: Bearer abc\r\n"),
              StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(Get("Host: weft.studio.example:9411\r\nAuthorization: Bearer \r\n"),
              StartsWith("HTTP/1.1 421"));
}

// A site whose name points at this machine (DNS rebinding) does not get through its visitors' browsers.
TEST_F(HttpListenerTest, RefusesHostsThatAreNotItsOwn) {
  Start({.host_names = {"Studio-1.local"}});
  EXPECT_THAT(Get("Host: studio-1.LOCAL:9\r\n"), StartsWith("HTTP/1.1 200"));
  for (const char* host : {"evil.example", "127.0.0.1.evil.example", "localhost.evil.example", "[evil", ""})
    EXPECT_THAT(Get(std::string("Host: ") + host + "\r\n"), StartsWith("HTTP/1.1 421")) << host;
  EXPECT_EQ(asked_, 1);
}

TEST_F(HttpListenerTest, RefusesPagesOfOtherOrigins) {
  Start();
  EXPECT_THAT(Get("Host: 127.0.0.1:9\r\nOrigin: http://127.0.0.1:9\r\n"), StartsWith("HTTP/1.1 200"));
  for (const char* origin : {"http://evil.example", "null", "https://127.0.0.1:8", "http://127.0.0.1:8"})
    EXPECT_THAT(Get(std::string("Host: 127.0.0.1:9\r\nOrigin: ") + origin + "\r\n"),
                StartsWith("HTTP/1.1 403"))
        << origin;
  EXPECT_EQ(asked_, 1);
}

TEST_F(HttpListenerTest, RefusesOtherMethodsAndBodies) {
  Start();
  EXPECT_THAT(Ask("POST / HTTP/1.1\r\nHost: localhost:9\r\nOrigin: http://localhost:9\r\n"
                  "Content-Length: 0\r\nConnection: close\r\n\r\n"),
              StartsWith("HTTP/1.1 405"));
  EXPECT_THAT(Ask("GET / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 4\r\nConnection: close\r\n\r\nbody"),
              Not(StartsWith("HTTP/1.1 200")));
  EXPECT_EQ(asked_, 0);
}

TEST_F(HttpListenerTest, OutlivesWhatIsNoRequest) {
  HttpListenerOptions options;
  options.stranger_patience = std::chrono::seconds(1);
  Start(options);
  for (const std::string& bytes :
       {std::string("\r\n\r\n\r\n"), std::string("GET\r\n\r\n"),
        std::string("\x16\x03\x01\x02\x00\x01", 6) + "\r\n\r\n",
        "GET /" + std::string(100'000, 'a') + " HTTP/1.1\r\n\r\n",
        "GET / HTTP/1.1\r\nHost: localhost\r\nX: " + std::string(100'000, 'b') + "\r\n\r\n"}) {
    const UniqueFd connection = Connect();
    (void)send(connection.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
    shutdown(connection.get(), SHUT_WR);
    EXPECT_THAT(Exchange(connection, ""), Not(StartsWith("HTTP/1.1 200")));
  }
  EXPECT_THAT(Get("Host: localhost\r\n"), StartsWith("HTTP/1.1 200"));
}

TEST_F(HttpListenerTest, LetsGoOfConnectionsThatSayNothing) {
  HttpListenerOptions options;
  options.stranger_patience = std::chrono::seconds(1);
  options.door.of_one_peer = 4;
  Start(options);
  std::vector<UniqueFd> silent;
  for (int i = 0; i < 20; ++i) silent.push_back(Connect());
  // All places of this address are taken; then they are free again.
  std::string answer;
  for (int i = 0; i < 100 && answer.find("200") == std::string::npos; ++i) {
    answer = Get("Host: localhost\r\n");
    usleep(100'000);
  }
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 200"));
}

TEST_F(HttpListenerTest, RefusesWhatIsNoCertificate) {
  UniqueFd listening(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  ASSERT_EQ(listen(listening.get(), 8), 0);
  const std::string file = ::testing::TempDir() + "no_certificate.pem";
  std::ofstream(file) << "-----BEGIN NOTHING-----\n";
  HttpListenerOptions options;
  options.uses_tls = true;
  options.tls.certificate = options.tls.key = file;
  const auto listener = HttpListener::Start(std::move(listening), options, {});
  EXPECT_EQ(listener.status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace weft
