// The HTTP listener, asked byte by byte.
#include "services/server/console/http_listener.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <openssl/ssl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <functional>

#include "tests/capture/temp_folder.h"
#include "tests/services/server/access/certificate_maker.h"

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

TEST_F(HttpListenerTest, RefusalsSayWhatToDo) {
  Start();
  const auto body = [](const std::string& answer) { return answer.substr(answer.find("\r\n\r\n") + 4); };
  EXPECT_EQ(
      body(Get("Host: evil.example\r\n")),
      R"({"code":"PERMISSION_DENIED","message":"Host: this is no name of this server; ask by its address, )"
      R"(show a token, or give weftd --console-host"})");
  EXPECT_EQ(
      body(Get("Host: 127.0.0.1:9\r\nOrigin: null\r\n")),
      R"({"code":"PERMISSION_DENIED","message":"Origin: only pages of this server are answered; a proxy must )"
      R"(pass on Host or X-Forwarded-Host as the browser sent it"})");
  EXPECT_EQ(body(Get("Host: 127.0.0.1:9\r\nSec-Fetch-Site: same-site\r\n")),
            R"({"code":"PERMISSION_DENIED","message":"requests of other sites are refused"})");
  const std::string no_path = Ask("GET /../a HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_THAT(no_path, StartsWith("HTTP/1.1 400"));
  EXPECT_THAT(no_path, HasSubstr("Connection: close"));
  EXPECT_EQ(body(no_path), R"({"code":"INVALID_ARGUMENT","message":"this is no path of this server"})");
  EXPECT_THAT(Get("Host: 127.0.0.1:9\r\nSec-Fetch-Site: none\r\n"), StartsWith("HTTP/1.1 200"));
  const std::string put =
      Ask("PUT / HTTP/1.1\r\nHost: [::1]\r\nOrigin: https://[::1]\r\nConnection: close\r\n\r\n");
  EXPECT_THAT(put, StartsWith("HTTP/1.1 405"));
  EXPECT_EQ(body(put), "GET and HEAD are answered\n");
  EXPECT_EQ(body(Ask("HEAD / HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")), "");
}

TEST_F(HttpListenerTest, AnswersSeveralRequestsOverOneConnection) {
  Start();
  const std::string get = "GET /a HTTP/1.1\r\nHost: localhost\r\n";
  const std::string answers = Ask(get + "\r\n" + get + "\r\n" + get + "Connection: close\r\n\r\n");
  EXPECT_EQ(asked_, 3);
  EXPECT_THAT(answers, HasSubstr("of 127.0.0.1HTTP/1.1 200 OK"));
  // The header may have 16 KiB, and no more.
  EXPECT_THAT(Get("Host: localhost\r\nX: " + std::string(16'000, 'b') + "\r\n"), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(Get("Host: localhost\r\nX: " + std::string(16'400, 'b') + "\r\n"),
              Not(StartsWith("HTTP/1.1 200")));
}

TEST_F(HttpListenerTest, KeepsOutWhoLeavesRequestsUnfinishedAndSaysSoOnce) {
  HttpListenerOptions options;
  options.stranger_patience = std::chrono::seconds(1);
  Start(options);
  ::testing::internal::CaptureStdout();
  std::vector<UniqueFd> unfinished;
  for (int i = 0; i < 3; ++i) {
    unfinished.push_back(Connect());
    EXPECT_EQ(send(unfinished.back().get(), "GET ", 4, MSG_NOSIGNAL), 4);
  }
  for (const UniqueFd& connection : unfinished) EXPECT_EQ(Exchange(connection, ""), "");
  std::string answer = "none yet";
  for (int i = 0; i < 100 && !answer.empty(); ++i) {
    answer = Get("Host: localhost\r\n");
    usleep(10'000);
  }
  EXPECT_EQ(answer, "");
  EXPECT_EQ(Get("Host: localhost\r\n"), "");
  const std::string log = ::testing::internal::GetCapturedStdout();
  const std::string told =
      "console: connections of 127.0.0.1 are refused: it makes too many, or leaves requests unfinished";
  EXPECT_NE(log.find(told), std::string::npos) << log;
  EXPECT_EQ(log.find(told), log.rfind(told));
}

class TlsListenerTest : public HttpListenerTest {
 protected:
  TlsListenerTest() {
    options_.uses_tls = true;
    options_.tls = {server_.certificate, server_.key, "", ""};
  }
  // What the server answers, and the subject of its certificate; "" where no connection comes about.
  std::string AskByTls(const std::string& headers, const std::function<void(SSL_CTX*)>& restrict = {}) {
    const std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)> context(SSL_CTX_new(TLS_client_method()),
                                                                    &SSL_CTX_free);
    if (restrict) restrict(context.get());
    const UniqueFd connection = Connect();
    const std::unique_ptr<SSL, decltype(&SSL_free)> tls(SSL_new(context.get()), &SSL_free);
    SSL_set_fd(tls.get(), connection.get());
    if (SSL_connect(tls.get()) != 1) return "";
    const std::unique_ptr<X509, decltype(&X509_free)> shown(SSL_get1_peer_certificate(tls.get()), &X509_free);
    char name[256] = "";
    X509_NAME_get_text_by_NID(X509_get_subject_name(shown.get()), NID_commonName, name, sizeof name);
    subject_ = name;
    const std::string request = "GET /a HTTP/1.1\r\n" + headers + "Connection: close\r\n\r\n";
    SSL_write(tls.get(), request.data(), static_cast<int>(request.size()));
    std::string answer;
    char bytes[4096];
    for (int n = 0; (n = SSL_read(tls.get(), bytes, sizeof bytes)) > 0;)
      answer.append(bytes, static_cast<size_t>(n));
    return answer;
  }

  TempFolder folder_;
  CertificateMaker maker_{folder_.path(), "studio"};
  const CertificateFiles server_ = maker_.Sign("server", 30, "DNS:vm.studio.example");
  HttpListenerOptions options_;
  std::string subject_;
};

TEST_F(TlsListenerTest, AnswersByTheNamesOfItsCertificate) {
  Start(options_);
  EXPECT_THAT(AskByTls("Host: vm.studio.example:9\r\nOrigin: https://vm.studio.example:9\r\n"),
              StartsWith("HTTP/1.1 200"));
  EXPECT_EQ(subject_, "server");
  EXPECT_THAT(AskByTls("Host: other.example\r\n"), StartsWith("HTTP/1.1 421"));
  // Pages that came without TLS may be anybody's.
  EXPECT_THAT(AskByTls("Host: vm.studio.example:9\r\nOrigin: http://vm.studio.example:9\r\n"),
              StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(Get("Host: localhost\r\n"), Not(StartsWith("HTTP/1.1")));
}

TEST_F(TlsListenerTest, SpeaksNoTlsThatIsBroken) {
  Start(options_);
  const std::string host = "Host: localhost\r\n";
  const auto with_cipher = [&](const char* name) {
    return AskByTls(host, [name](SSL_CTX* context) {
      SSL_CTX_set_max_proto_version(context, TLS1_2_VERSION);
      SSL_CTX_set_cipher_list(context, name);
    });
  };
  EXPECT_THAT(with_cipher("ECDHE-ECDSA-AES128-GCM-SHA256"), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(with_cipher("ECDHE-ECDSA-CHACHA20-POLY1305"), StartsWith("HTTP/1.1 200"));
  EXPECT_EQ(with_cipher("ECDHE-ECDSA-AES128-SHA"), "");
  EXPECT_EQ(AskByTls(host,
                     [](SSL_CTX* context) {
                       SSL_CTX_set_min_proto_version(context, TLS1_VERSION);
                       SSL_CTX_set_max_proto_version(context, TLS1_1_VERSION);
                       SSL_CTX_set_cipher_list(context, "DEFAULT@SECLEVEL=0");
                     }),
            "");
}

TEST_F(TlsListenerTest, TakesUpANewCertificateAndNoBrokenOne) {
  Start(options_);
  const CertificateFiles next = maker_.Sign("next", 30, "DNS:next.example");
  std::filesystem::copy_file(next.certificate, server_.certificate,
                             std::filesystem::copy_options::overwrite_existing);
  std::filesystem::copy_file(next.key, server_.key, std::filesystem::copy_options::overwrite_existing);
  EXPECT_THAT(AskByTls("Host: next.example\r\n"), StartsWith("HTTP/1.1 200"));
  EXPECT_EQ(subject_, "next");
  EXPECT_THAT(AskByTls("Host: vm.studio.example\r\n"), StartsWith("HTTP/1.1 421"));
  address_.sin_port = 0;
  Start(options_);
  WriteBytes(server_.key, "no key");
  EXPECT_THAT(AskByTls("Host: next.example\r\n"), StartsWith("HTTP/1.1 200"));
  EXPECT_EQ(subject_, "next");
}

TEST_F(TlsListenerTest, NeedsCertificateAndKeyThatBelongTogether) {
  const auto error_of = [&](const std::string& certificate, const std::string& key) {
    UniqueFd listening(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    EXPECT_EQ(listen(listening.get(), 8), 0);
    options_.tls.certificate = certificate, options_.tls.key = key;
    return HttpListener::Start(std::move(listening), options_, {}).status();
  };
  const std::string other = maker_.Sign("other").key;
  EXPECT_EQ(error_of(server_.certificate, other),
            absl::InvalidArgumentError("no HTTPS server starts with " + server_.certificate + " and " +
                                       other + "; do they belong together?"));
  EXPECT_TRUE(absl::IsNotFound(error_of(folder_ / "none", server_.key)));
  EXPECT_TRUE(absl::IsNotFound(error_of(server_.certificate, folder_ / "none")));
}

}  // namespace
}  // namespace weft
