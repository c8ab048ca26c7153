#include "services/server/notice/notice_request.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sys/stat.h>

#include <chrono>
#include <cstdlib>
#include <stop_token>
#include <string>

#include "absl/strings/str_cat.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/server/notice/answering_server.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

NoticeServer ServerAt(const std::string& url) {
  NoticeServer server;
  server.url = url;
  return server;
}

TEST(NoticeServer, IsAskedByHttpOnlyOnThisMachine) {
  for (const char* right :
       {"https://studio.example/weft", "https://studio.example", "http://localhost/", "http://LOCALHOST:80/x",
        "http://127.0.0.1:8080/a/b?c=d", "http://[::1]:80/x", "http://127.0.0.2"})
    EXPECT_TRUE(CheckNoticeServer(ServerAt(right)).ok()) << right;
  for (const char* wrong : {"http://studio.example/weft",
                            "http://127.evil.invalid/",
                            "http://127.0.0.1.evil.invalid/",
                            "http://localhost.evil.invalid/",
                            "http://localhost./",
                            "http://0x7f000001/",
                            "http://2130706433/",
                            "http://0177.0.0.1/",
                            "http://127.1/",
                            "http://[::2]/",
                            "http://[::ffff:127.0.0.1]/",
                            "http://user:pw@127.0.0.1/",
                            "http://127.0.0.1@evil.invalid/",
                            "http://@127.0.0.1/",
                            "http://127.0.0.1\\@evil.invalid/",
                            "http://127.0.0.1\r\nX: y/",
                            "http://127.0.0.1 /",
                            "gopher://127.0.0.1/",
                            "file:///etc/passwd",
                            "127.0.0.1/x",
                            "studio.example",
                            "http:///x",
                            "http://"})
    EXPECT_EQ(CheckNoticeServer(ServerAt(wrong)).code(), absl::StatusCode::kInvalidArgument) << wrong;
}

TEST(NoticeServer, IsShownWithoutItsPath) {
  EXPECT_EQ(ShownUrl("https://hooks.example/services/T0/B0/secret"), "https://hooks.example/[redacted]");
  EXPECT_EQ(ShownUrl("https://hooks.example:444?key=secret"), "https://hooks.example:444/[redacted]");
  EXPECT_EQ(ShownUrl("https://hooks.example/"), "https://hooks.example/");
  EXPECT_EQ(ShownUrl("https://hooks.example"), "https://hooks.example");
  EXPECT_EQ(ShownUrl("http://anna:pw@host/x"), "http://[redacted]@host/[redacted]");
  EXPECT_EQ(ShownUrl("secret without a scheme"), "[redacted]");
}

TEST(NoticeServer, IsNamedInMessagesWithoutItsSecret) {
  const TempFolder temp;
  WriteBytes(temp / "notice.json", "{}");
  const std::string secret = "SECRETPATHabcdef0123";
  for (const std::string& url : {"http://127.0.0.1:1/" + secret, "http://studio.example/" + secret,
                                 "ftp://studio.example/" + secret, "http://127.0.0.1/a " + secret}) {
    const absl::Status status = PostNotice(ServerAt(url), temp / "notice.json", {});
    EXPECT_FALSE(status.ok());
    EXPECT_THAT(std::string(status.message()), AllOf(HasSubstr("[redacted]"), Not(HasSubstr(secret)))) << url;
  }
}

constexpr char kTaken[] = "HTTP/1.1 200 OK\r\nContent-Length: 0\r\nConnection: close\r\n\r\n";

// An answer without a length ends with its connection.
std::string Answer(const std::string& status, const std::string& body = "", const std::string& more = "") {
  return absl::StrCat("HTTP/1.1 ", status, "\r\n", more, "Connection: close\r\n\r\n", body);
}

class PostedNotice : public ::testing::Test {
 protected:
  PostedNotice() { WriteBytes(folder_ / "notice.json", kBody); }

  absl::Status Post(NoticeServer server, const std::stop_token& stop = {}) {
    return PostNotice(server, folder_ / "notice.json", stop);
  }
  // To a server that answers so.
  std::string Refusal(const std::string& answer, const std::string& path = "/x") {
    const AnsweringServer server(answer);
    const absl::Status status = Post(ServerAt(server.Url(path)));
    EXPECT_TRUE(status.ok() || absl::IsUnavailable(status)) << status;
    const std::string shown = absl::StrCat("http://127.0.0.1:", server.port(), "/[redacted]: ");
    const std::string message(status.message());
    return message.starts_with(shown) ? message.substr(shown.size()) : message;
  }
  std::string Secret(const std::string& text, mode_t mode = 0600) {
    WriteBytes(folder_ / "secret", text);
    EXPECT_EQ(chmod((folder_ / "secret").c_str(), mode), 0);
    return folder_ / "secret";
  }

  const std::string kBody = "{\"id\": \"" + std::string(5000, 'n') + "\"}";
  const TempFolder folder_;
};

TEST_F(PostedNotice, IsJsonWithItsSignature) {
  AnsweringServer server(kTaken);
  NoticeServer notices = ServerAt(server.Url("/hook?x=1"));
  EXPECT_TRUE(Post(notices).ok());
  notices.secret_file = Secret("0123456789abcdef\n");
  EXPECT_TRUE(Post(notices).ok());
  const std::vector<std::string> asked = server.Asked();
  ASSERT_EQ(asked.size(), 2u);
  EXPECT_THAT(asked[0], ::testing::StartsWith("POST /hook?x=1 HTTP/1.1\r\n"));
  EXPECT_THAT(asked[0], HasSubstr("\r\nContent-Type: application/json\r\n"));
  EXPECT_THAT(asked[0], HasSubstr("\r\nUser-Agent: weftd/" WEFT_VERSION "\r\n"));
  EXPECT_THAT(asked[0], HasSubstr(absl::StrCat("\r\nContent-Length: ", kBody.size(), "\r\n")));
  EXPECT_THAT(asked[0], ::testing::EndsWith("\r\n\r\n" + kBody));
  EXPECT_THAT(asked[0], AllOf(Not(HasSubstr("Expect")), Not(HasSubstr("X-Weft-Signature"))));
  EXPECT_THAT(asked[1],
              HasSubstr("\r\nX-Weft-Signature: " + SignatureOf("0123456789abcdef", kBody) + "\r\n"));
}

TEST_F(PostedNotice, IsTakenWhereTheServerSaysSo) {
  for (const char* status : {"200 OK", "204 No Content", "299 Fine"}) EXPECT_EQ(Refusal(Answer(status)), "");
  EXPECT_EQ(Refusal(Answer("404 Not Found", "gone")), "answers 404: gone");
  EXPECT_EQ(Refusal(Answer("500 Oops")), "answers 500");
  EXPECT_EQ(Refusal(Answer("300 Many")), "answers 300, and redirects are not followed");
  EXPECT_EQ(Refusal(Answer("400 Bad", std::string(150, 'a') + std::string(60, 'b'))),
            "answers 400: " + std::string(150, 'a') + std::string(50, 'b'));
}

TEST_F(PostedNotice, GoesNowhereElse) {
  AnsweringServer other(kTaken);
  EXPECT_EQ(Refusal(Answer("307 Else", "", absl::StrCat("Location: ", other.Url("/"), "\r\n"))),
            "answers 307, and redirects are not followed");
  // A proxy of the environment is for other machines.
  setenv("http_proxy", other.Url("").c_str(), 1);
  EXPECT_EQ(Refusal(kTaken), "");
  unsetenv("http_proxy");
  EXPECT_TRUE(other.Asked().empty());
}

// Six characters of the path may be guessed from; fewer are words.
TEST_F(PostedNotice, IsNotQuotedWithThePath) {
  const auto shown = [this](const std::string& answer) {
    return Refusal(Answer("410 Gone", answer), "/abcdefgh?key=vwxyz1");
  };
  EXPECT_EQ(shown("no /abcdefgh here"), "answers 410: no /[redacted] here");
  EXPECT_EQ(shown("abcde abcdef bcdefgh"), "answers 410: abcde [redacted] [redacted]");
  EXPECT_EQ(shown("key=vwxyz1"), "answers 410: [redacted]");
  EXPECT_EQ(shown("127.0.0.1 is away"), "answers 410: 127.0.0.1 is away");
}

TEST_F(PostedNotice, WaitsForAnAnswerAsLongAsItIsTold) {
  const AnsweringServer silent("");
  NoticeServer notices = ServerAt(silent.Url("/x"));
  notices.patience = std::chrono::milliseconds(50);
  const absl::Status late = Post(notices);
  EXPECT_TRUE(absl::IsUnavailable(late)) << late;
  EXPECT_THAT(std::string(late.message()), HasSubstr("imed out"));
  notices.patience = std::chrono::minutes(2);
  std::stop_source stop;
  stop.request_stop();
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(Post(notices, stop.get_token()), absl::CancelledError("the daemon stops"));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::minutes(1));
}

TEST_F(PostedNotice, ByTlsGoesToWhomAnAuthorityVouchesFor) {
  CertificateMaker maker(folder_.path(), "studio");
  AnsweringServer server(kTaken, maker.Sign("server"));
  NoticeServer notices = ServerAt(server.Url("/x"));
  EXPECT_TRUE(absl::IsUnavailable(Post(notices))) << "nobody knows the authority";
  notices.authority = maker.authority();
  EXPECT_TRUE(Post(notices).ok()) << Post(notices);
  EXPECT_EQ(server.Asked().size(), 1u);
  AnsweringServer other(kTaken, maker.Sign("other", 30, "DNS:other.example"));
  notices.url = other.Url("/x");
  EXPECT_TRUE(absl::IsUnavailable(Post(notices))) << "it is of another server";
  EXPECT_TRUE(other.Asked().empty());
}

TEST_F(PostedNotice, IsNotSentWithoutWhatSignsIt) {
  AnsweringServer server(kTaken);
  NoticeServer notices = ServerAt(server.Url("/x"));
  notices.secret_file = folder_ / "missing";
  EXPECT_TRUE(absl::IsUnavailable(Post(notices))) << "it may be mended";
  EXPECT_TRUE(absl::IsNotFound(PostNotice(ServerAt(notices.url), folder_ / "none.json", {})));
  EXPECT_TRUE(absl::IsInvalidArgument(Post(ServerAt("http://studio.example/"))));
  EXPECT_TRUE(server.Asked().empty());
}

TEST_F(PostedNotice, NeedsASecretThatOthersCannotReadOrGuess) {
  NoticeServer notices = ServerAt("https://studio.example/x");
  const auto check = [&](const std::string& file) {
    notices.secret_file = file;
    return CheckNoticeServer(notices);
  };
  EXPECT_TRUE(check("").ok());
  EXPECT_TRUE(check(Secret("0123456789abcdef")).ok());
  EXPECT_TRUE(check(Secret(std::string(4096, 's'))).ok());
  EXPECT_TRUE(absl::IsInvalidArgument(check(Secret(std::string(4097, 's')))));
  const std::string file = folder_ / "secret";
  EXPECT_EQ(
      check(Secret(" 0123456789abcde\n")),
      absl::InvalidArgumentError(absl::StrCat(
          "--on-end-secret: ", file, " has less than 16 characters; `openssl rand -hex 32` makes one")));
  for (const mode_t mode : {0640, 0604, 0620, 0601}) {
    EXPECT_EQ(
        check(Secret("0123456789abcdef", mode)),
        absl::PermissionDeniedError(absl::StrCat(
            "--on-end-secret: ", file, ": other users may read it; close it by `chmod go-rwx ", file, "`")));
  }
  const absl::Status missing = check(folder_ / "none");
  EXPECT_TRUE(absl::IsInvalidArgument(missing));
  EXPECT_THAT(std::string(missing.message()),
              AllOf(::testing::StartsWith("--on-end-secret: "), ::testing::EndsWith("; name a file")));
}

TEST_F(PostedNotice, NeedsAnAuthorityThatCanBeRead) {
  NoticeServer notices = ServerAt("https://studio.example/x");
  notices.authority = folder_ / "ca.pem";
  const absl::Status missing = CheckNoticeServer(notices);
  EXPECT_TRUE(absl::IsInvalidArgument(missing));
  EXPECT_THAT(std::string(missing.message()),
              AllOf(::testing::StartsWith("--on-end-ca: "), HasSubstr("ca.pem"),
                    ::testing::EndsWith("; name a PEM file")));
  WriteBytes(notices.authority, std::string(1 << 20, 'p'));
  EXPECT_TRUE(CheckNoticeServer(notices).ok());
  WriteBytes(notices.authority, std::string((1 << 20) + 1, 'p'));
  EXPECT_FALSE(CheckNoticeServer(notices).ok());
  notices.url.clear();
  EXPECT_TRUE(CheckNoticeServer(notices).ok()) << "it is not asked";
}

TEST(NoticeServer, SaysWhatIsWrongWithItsUrl) {
  const auto error_of = [](const std::string& url) {
    return std::string(CheckNoticeServer(ServerAt(url)).message());
  };
  EXPECT_EQ(
      error_of("http://studio.example/x"),
      "--on-end-url: \"http://studio.example/[redacted]\" would send notices for everybody to read; use "
      "https; http is for servers of this machine: localhost, 127.0.0.1 or [::1]");
  EXPECT_EQ(error_of("https://a b/"),
            "--on-end-url: \"https://a b/\" is no URL; for example https://studio.example/weft");
  EXPECT_EQ(error_of("https://anna@studio.example/"),
            "--on-end-url: has a user's name; show who asks by --on-end-secret");
  for (const char* odd :
       {"https://x/\"", "https://x/<", "https://x/>", "https://x/^", "https://x/`", "https://x/{",
        "https://x/|", "https://x/}", "https://x/\x7f", "https://x/\xc3\xa4"})
    EXPECT_THAT(error_of(odd), HasSubstr("is no URL")) << odd;
  EXPECT_EQ(error_of("https://x/~a?b=%20&c=[1]#d"), "");
}

}  // namespace
}  // namespace weft
