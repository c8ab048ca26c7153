#include "services/server/notice/notice_request.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/capture/temp_folder.h"

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

}  // namespace
}  // namespace weft
