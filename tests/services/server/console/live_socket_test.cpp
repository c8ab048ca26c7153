// Streams of pages over one socket.
#include "services/server/console/live_socket.h"

#include "absl/strings/str_cat.h"
#include "tests/services/server/console/console_fixture.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

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
  // A stream that ended leaves its number.
  Send(connection, Frame(absl::StrCat("5 Jobs.WatchJob\n{\"jobId\": \"", job->id(), "\"}")));
  const std::string end = Receive(connection, "5 end\n{\"code\":\"OK\"}");
  EXPECT_THAT(end, HasSubstr("JOB_STATE_DONE"));
  EXPECT_THAT(end, Not(HasSubstr("is taken")));
}

TEST_F(ConsoleTest, OrdersThatCannotBeCarriedOutEndAtOnce) {
  LogIn(TokenOf(v1::ROLE_CLIENT));
  std::vector<std::string> frames;
  for (int i = 10; i < 40; ++i) frames.push_back(absl::StrCat("slow_", i));  // it ends with its daemon
  const absl::StatusOr<v1::Job> job = client_->Submit(MakeRequest(frames));
  ASSERT_TRUE(job.ok()) << job.status();
  const UniqueFd connection = Connect();
  Send(connection,
       absl::StrCat("GET /live HTTP/1.1\r\nHost: 127.0.0.1:", port_, "\r\nCookie: ", cookie_,
                    "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n",
                    Origin(), "\r\n"));
  Receive(connection, "0 alive\n");
  const std::string watch = absl::StrCat(" Jobs.WatchJob\n{\"jobId\": \"", job->id(), "\"}");
  const auto told = [&](const std::string& order, const std::string& end) {
    Send(connection, Frame(order));
    const std::string all = Receive(connection, "\"}");
    EXPECT_THAT(all, HasSubstr(end));
  };
  told("0" + watch, R"(0 end
{"code":"INVALID_ARGUMENT","message":"the number is taken; give each stream its own"})");
  told("2 Jobs.Nothing\n{}", "2 end\n{\"code\":\"UNIMPLEMENTED\",\"message\":\"there is no such method\"}");
  told("3 Jobs.WatchJob\n{\"x\": 1}", "3 end\n{\"code\":\"INVALID_ARGUMENT\"");
  told("x", R"(0 end
{"code":"INVALID_ARGUMENT","message":"an order begins with a number and a space"})");
  Send(connection, Frame("4" + watch));
  EXPECT_THAT(Receive(connection, "4 message\n"), HasSubstr("4 message\n"));
  Send(connection, Frame("4" + watch));
  EXPECT_THAT(Receive(connection, "is taken"), HasSubstr("4 end\n{\"code\":\"INVALID_ARGUMENT\""));
  // One that was cancelled says no more, and its number may be taken again.
  Send(connection, Frame("4 cancel"));
  Send(connection, Frame("9 cancel"));  // there is none
  Send(connection, Frame("4 Jobs.WatchJob\n{\"jobId\": \"none\"}"));
  EXPECT_THAT(Receive(connection, "NOT_FOUND"), Not(HasSubstr("is taken")));
}

}  // namespace
}  // namespace weft
