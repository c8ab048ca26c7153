// The console of a daemon, asked byte by byte.
#include "services/server/console/console.h"

#include <thread>

#include "absl/strings/str_cat.h"
#include "base/host_clock.h"
#include "services/server/access/audit_log.h"
#include "services/server/console/json_messages.h"
#include "tests/services/server/console/console_fixture.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

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

TEST_F(ConsoleTest, EndsWithItsDaemonWhilePagesWatch) {
  LogIn(TokenOf(v1::ROLE_CLIENT));
  const UniqueFd connection = Connect();
  Send(connection, "GET /session HTTP/1.1\r\n");  // and no end
  daemon_.reset();
  EXPECT_EQ(Receive(connection), "");
}

TEST_F(ConsoleTest, PagesAreServedToEverybody) {
  const Reply page = Parsed(Get("/"));
  EXPECT_EQ(page.status, "HTTP/1.1 200 OK");
  EXPECT_EQ(page.body, "<!doctype html>" + std::string(1000, 'x'));
  const std::string tag = page.headers.at("ETag");
  const std::map<std::string, std::string> of_all = {
      {"Content-Type", "text/html; charset=utf-8"},
      {"X-Content-Type-Options", "nosniff"},
      {"Content-Security-Policy",
       "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' data: "
       "blob:; "
       "connect-src 'self'; worker-src 'self'; frame-src 'self'; base-uri 'none'; form-action 'none'; "
       "frame-ancestors 'self'"},
      {"Cross-Origin-Resource-Policy", "same-origin"},
      {"Cross-Origin-Opener-Policy", "same-origin"},
      {"Referrer-Policy", "no-referrer"},
      {"Vary", "Accept-Encoding"},
      {"ETag", tag},
      {"Cache-Control", "no-cache"},
      {"Content-Length", "1015"},
      {"Connection", "close"}};
  EXPECT_EQ(page.headers, of_all);
  const Reply packed = Parsed(Get("/", "Accept-Encoding: br, gzip\r\n"));
  EXPECT_EQ(packed.headers.at("Content-Encoding"), "gzip");
  EXPECT_THAT(packed.body, StartsWith("\x1f\x8b"));
  const Reply known = Parsed(Get("/", "If-None-Match: " + tag + "\r\n"));
  EXPECT_EQ(known.status, "HTTP/1.1 304 Not Modified");
  EXPECT_EQ(known.body, "");
  const Reply script = Parsed(Get("/assets/main-1a2b3c4d.js", "Accept-Encoding: gzip\r\n"));
  EXPECT_EQ(script.body, "1;");
  EXPECT_EQ(script.headers.at("Cache-Control"), "public, max-age=31536000, immutable");
  EXPECT_FALSE(script.headers.contains("Content-Encoding"));
  const Reply head = Parsed(Ask(absl::StrCat("HEAD / HTTP/1.1\r\n", Headers(), "\r\n")));
  EXPECT_EQ(head.headers, of_all);
  EXPECT_EQ(head.body, "");
  // A link of another site leads here, and nowhere else.
  const std::string from_elsewhere = "Sec-Fetch-Site: cross-site\r\nSec-Fetch-Mode: navigate\r\n";
  EXPECT_THAT(Get("/", from_elsewhere), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(Get("/assets/main-1a2b3c4d.js", from_elsewhere), StartsWith("HTTP/1.1 403"));
  options_.console_files.clear();
  client_.reset(), daemon_.reset();
  StartConsole();
  const Reply none = Parsed(Get("/"));
  EXPECT_EQ(none.status, "HTTP/1.1 404 Not Found");
  EXPECT_EQ(none.headers.at("Content-Type"), "text/plain; charset=utf-8");
  EXPECT_THAT(none.body, StartsWith("This weftd was built without its console's pages."));
}

TEST_F(ConsoleTest, WhatIsNotThereIsSaidToThoseWhoAreKnown) {
  const std::string away = R"({"code":"NOT_FOUND","message":"there is nothing here; the console is at /"})";
  EXPECT_THAT(Get("/nothing"), StartsWith("HTTP/1.1 401"));
  LogIn(TokenOf(v1::ROLE_VIEWER));
  EXPECT_EQ(Parsed(Get("/nothing")).body, away);
  for (const char* path : {"/session", "/file/Jobs/FetchResult", "/mesh/a/b", "/nothing", "/"})
    EXPECT_EQ(Parsed(Post(path, "{}")).body, away) << path;
  for (const char* path : {"/logout", "/login", "/api/Jobs/ListJobs", "/live"})
    EXPECT_EQ(Parsed(Get(path)).body, away) << path;
  const Reply put = Parsed(Ask(absl::StrCat("PUT /session HTTP/1.1\r\n", Headers(Origin()), "\r\n")));
  EXPECT_EQ(put.status, "HTTP/1.1 405 Method Not Allowed");
  EXPECT_EQ(put.body, R"({"code":"UNIMPLEMENTED","message":"GET, HEAD and POST are answered"})");
  EXPECT_EQ(Parsed(Post("/api/Jobs/WatchJob", "{}")).body,
            R"({"code":"UNIMPLEMENTED","message":"Jobs/WatchJob: there is no such method with one answer"})");
}

TEST_F(ConsoleTest, LogsInForADayAndTellsTheAuditLog) {
  const int64_t before_ns = HostTime_ns();
  EXPECT_THAT(Parsed(LogIn("")).body, HasSubstr("token: it is missing"));
  EXPECT_EQ(Parsed(Post("/login", "{\"token\": 7, \"x\": 1}")).body,
            R"({"code":"INVALID_ARGUMENT","message":"a ConsoleLogin is asked for"})");
  const Reply reply = Parsed(LogIn(TokenOf(v1::ROLE_CLIENT)));
  const std::string name = absl::StrCat("weft_", port_, "="), id = cookie_.substr(name.size());
  EXPECT_EQ(reply.headers.at("Set-Cookie"), name + id + "; Path=/; HttpOnly; SameSite=Strict; Max-Age=86400");
  EXPECT_EQ(id.size(), 64u);
  v1::ConsoleUser user;
  ASSERT_TRUE(FromJson(reply.body, user).ok()) << reply.body;
  EXPECT_THAT(user.caller(), ::testing::MatchesRegex("token [0-9a-f]{12} .anna."));
  EXPECT_EQ(user.role(), v1::ROLE_CLIENT);
  EXPECT_NE(user.weft_version(), "");
  const int64_t day_ns = int64_t{24} * 3600 * 1'000'000'000;
  EXPECT_GE(user.expires_unix_ns(), before_ns + day_ns);
  EXPECT_LE(user.expires_unix_ns(), HostTime_ns() + day_ns);
  EXPECT_EQ(Parsed(Get("/session")).body, reply.body);
  const Reply out = Parsed(Post("/logout", "{}"));
  EXPECT_EQ(out.body, "{}");
  EXPECT_EQ(out.headers.at("Set-Cookie"), name + "; Path=/; HttpOnly; SameSite=Strict; Max-Age=0");
  std::vector<std::string> entries;
  const auto log = ReadAuditLog(AuditLogFile(options_.state_folder), 100).value();
  for (const v1::AuditEntry& entry : log)
    if (entry.method() == "POST /login")
      entries.push_back(
          absl::StrCat(entry.peer(), "|", entry.outcome(), "|", entry.caller(), "|", entry.message()));
  EXPECT_THAT(entries, ::testing::ElementsAre("127.0.0.1|UNAUTHENTICATED||token: it is missing",
                                              "127.0.0.1|INVALID_ARGUMENT||a ConsoleLogin is asked for",
                                              "127.0.0.1|OK|" + user.caller() + "|"));
}

TEST_F(ConsoleTest, AnswersAreTheMessagesOfTheApi) {
  LogIn(TokenOf(v1::ROLE_CLIENT));
  const Reply list = Parsed(Post("/api/Jobs/ListJobs", "{}"));
  EXPECT_EQ(list.status, "HTTP/1.1 200 OK");
  EXPECT_EQ(list.headers.at("Content-Type"), "application/json");
  EXPECT_EQ(list.headers.at("Cache-Control"), "no-store");
  EXPECT_EQ(list.body, "{}");
  const Reply form =
      Parsed(Ask(absl::StrCat("POST /login HTTP/1.1\r\n", Headers(Origin()), "Content-Length: 2\r\n\r\n{}")));
  EXPECT_EQ(form.status, "HTTP/1.1 415 Unsupported Media Type");
  EXPECT_EQ(form.body, R"({"code":"INVALID_ARGUMENT","message":"Content-Type: must be application/json"})");
}

// Two requests over one connection, each whole.
TEST_F(ConsoleTest, ConnectionsAreKept) {
  const UniqueFd connection = Connect();
  const std::string get = absl::StrCat("GET /assets/main-1a2b3c4d.js HTTP/1.1\r\nHost: localhost\r\n");
  Send(connection, get + "\r\n");
  EXPECT_THAT(Receive(connection, "1;"), Not(HasSubstr("Connection: close")));
  Send(connection, get + "Connection: close\r\n\r\n");
  EXPECT_THAT(Receive(connection), StartsWith("HTTP/1.1 200"));
  // What was not read of a request stands in the way of the next one.
  const UniqueFd other = Connect();
  Send(other, absl::StrCat("POST /session HTTP/1.1\r\nHost: localhost:", port_,
                           "\r\nOrigin: http://localhost:", port_, "\r\nContent-Length: 5\r\n\r\n"));
  EXPECT_THAT(Receive(other), HasSubstr("Connection: close"));
}

}  // namespace
}  // namespace weft
