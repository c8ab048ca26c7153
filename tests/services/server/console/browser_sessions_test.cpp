#include "services/server/console/browser_sessions.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "absl/strings/str_cat.h"
#include "base/host_clock.h"
#include "services/server/access/access_list.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

constexpr int64_t kHour_ns = int64_t{3600} * 1'000'000'000;

class BrowserSessionsTest : public ::testing::Test {
 protected:
  BrowserSessionsTest() {
    access_.emplace(
        list_, [](const std::string&) {}, [this] { return now_ns_; });
  }

  BrowserSessions Make() {
    return {folder_ / "console.json", *access_, [this] { return now_ns_; }};
  }
  std::string NewToken(const std::string& name) {
    now_ns_ += 2'000'000'000;  // the list is looked at twice a second at most
    return AddToken(list_, {name, v1::ROLE_VIEWER}).value().text;
  }

  TempFolder folder_;
  const std::string list_ = AccessListFile(folder_.path());
  int64_t now_ns_ = HostTime_ns();
  std::optional<AccessControl> access_;
};

TEST_F(BrowserSessionsTest, LastsADayAndOutlivesTheDaemon) {
  const std::string token = NewToken("anna");
  std::string id;
  {
    BrowserSessions sessions = Make();
    const auto begun = sessions.Begin(token, "10.0.0.5");
    ASSERT_TRUE(begun.ok()) << begun.status();
    id = begun->id;
    EXPECT_EQ(sessions.Find(id)->caller.role, v1::ROLE_VIEWER);
  }
  const std::string kept = ReadBytes(folder_ / "console.json");
  EXPECT_EQ(kept.find(id), std::string::npos);
  EXPECT_EQ(kept.find(token), std::string::npos);
  struct stat file = {};
  ASSERT_EQ(stat((folder_ / "console.json").c_str(), &file), 0);
  EXPECT_EQ(file.st_mode & 0777, 0600u);
  BrowserSessions next = Make();
  EXPECT_TRUE(next.Find(id).ok());
  now_ns_ += 23 * kHour_ns;
  EXPECT_TRUE(next.Find(id).ok());
  now_ns_ += 2 * kHour_ns;
  EXPECT_EQ(next.Find(id).status().code(), absl::StatusCode::kUnauthenticated);
}

TEST_F(BrowserSessionsTest, EndsWithItsTokenOrOnRequest) {
  const weft::NewToken added = AddToken(list_, {"anna", v1::ROLE_VIEWER}).value();
  now_ns_ += 2'000'000'000;
  BrowserSessions sessions = Make();
  const std::string first = sessions.Begin(added.text, "p")->id, second = sessions.Begin(added.text, "p")->id;
  EXPECT_NE(first, second);
  sessions.End(first);
  EXPECT_FALSE(sessions.Find(first).ok());
  EXPECT_TRUE(sessions.Find(second).ok());
  ASSERT_TRUE(RevokeAccess(list_, added.token.id()).ok());
  now_ns_ += 2'000'000'000;
  EXPECT_FALSE(sessions.Find(second).ok());
  for (const char* id : {"", "x", "0000000000000000000000000000000000000000000000000000000000000000"})
    EXPECT_EQ(sessions.Find(id).status().code(), absl::StatusCode::kUnauthenticated);
}

TEST_F(BrowserSessionsTest, WrongTokensOfAPeerAreLimitedAndOthersAreNot) {
  const std::string token = NewToken("anna");
  BrowserSessions sessions = Make();
  for (int k = 0; k < 10; ++k)
    EXPECT_EQ(sessions.Begin("wrong", "10.0.0.6").status().code(), absl::StatusCode::kUnauthenticated);
  EXPECT_EQ(sessions.Begin(token, "10.0.0.6").status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_TRUE(sessions.Begin(token, "10.0.0.7").ok());
  now_ns_ += int64_t{7} * 1'000'000'000;
  EXPECT_TRUE(sessions.Begin(token, "10.0.0.6").ok());
}

TEST_F(BrowserSessionsTest, TheOldestGoesWhereOneTokenHasTooMany) {
  const std::string token = NewToken("anna"), other = NewToken("bert");
  now_ns_ += 2'000'000'000;
  BrowserSessions sessions = Make();
  const std::string of_other = sessions.Begin(other, "p")->id, oldest = sessions.Begin(token, "p")->id;
  std::string last;
  for (size_t k = 0; k < BrowserSessions::kMostOfOneToken; ++k) last = sessions.Begin(token, "p")->id;
  EXPECT_FALSE(sessions.Find(oldest).ok());
  EXPECT_TRUE(sessions.Find(last).ok());
  EXPECT_TRUE(sessions.Find(of_other).ok());
}

TEST_F(BrowserSessionsTest, ADamagedFileIsAsNone) {
  WriteBytes(folder_ / "console.json", "{\"sessions\": 7");
  const std::string token = NewToken("anna");
  BrowserSessions sessions = Make();
  EXPECT_TRUE(sessions.Begin(token, "p").ok());
}

TEST_F(BrowserSessionsTest, IsWholeInItsFileAndAfterwards) {
  const weft::NewToken added = AddToken(list_, {"anna", v1::ROLE_CLIENT}).value();
  now_ns_ += 2'000'000'000;
  const auto begun = Make().Begin(added.text, "p");
  ASSERT_TRUE(begun.ok()) << begun.status();
  EXPECT_EQ(begun->id.size(), 64u);
  const std::string name = "token " + added.token.id() + " (anna)";
  const auto expect_whole = [&](const BrowserSession& session) {
    EXPECT_EQ(session.id_sha256, HashOfToken(begun->id));
    EXPECT_EQ(session.token_sha256, added.token.sha256());
    EXPECT_EQ(session.caller.name, name);
    EXPECT_EQ(session.caller.role, v1::ROLE_CLIENT);
    EXPECT_EQ(session.expires_unix_ns, now_ns_ + 24 * kHour_ns);
  };
  expect_whole(begun->session);
  expect_whole(Make().Find(begun->id).value());
}

TEST_F(BrowserSessionsTest, LastsToItsLastNanosecond) {
  BrowserSessions sessions = Make();
  const std::string id = sessions.Begin(NewToken("anna"), "p")->id;
  now_ns_ += 24 * kHour_ns - 1;
  EXPECT_TRUE(sessions.Find(id).ok());
  ++now_ns_;
  EXPECT_EQ(sessions.Find(id).status(),
            absl::UnauthenticatedError("this browser is not logged in, or no longer; log in with a token"));
}

TEST_F(BrowserSessionsTest, AreTwentyOfAToken) {
  const std::string token = NewToken("anna"), other = NewToken("bert");
  BrowserSessions sessions = Make();
  std::vector<std::string> ids;
  for (int k = 0; k < 20; ++k) ids.push_back(sessions.Begin(token, "p")->id);
  EXPECT_TRUE(sessions.Begin(other, "p").ok());
  for (const std::string& id : ids) EXPECT_TRUE(sessions.Find(id).ok());
  // Those that ended leave their places.
  now_ns_ += 24 * kHour_ns;
  ids.clear();
  for (int k = 0; k < 20; ++k) ids.push_back(sessions.Begin(token, "p")->id);
  for (const std::string& id : ids) EXPECT_TRUE(sessions.Find(id).ok());
  const std::string kept = ReadBytes(folder_ / "console.json");
  EXPECT_EQ(kept.find(HashOfToken(other)), std::string::npos);
}

TEST_F(BrowserSessionsTest, AreTwoHundredInAll) {
  std::string kept = "{\"sessions\": [";
  for (int k = 0; k < 199; ++k) {
    absl::StrAppend(&kept, k == 0 ? "" : ", ", "{\"idSha256\": \"id-", k, "\", \"tokenSha256\": \"token-", k,
                    "\", \"expiresUnixNs\": \"", now_ns_ + kHour_ns, "\"}");
  }
  const std::string file = folder_ / "console.json", token = NewToken("anna");
  WriteBytes(file, kept + "]}");
  BrowserSessions sessions = Make();
  ASSERT_TRUE(sessions.Begin(token, "p").ok());
  EXPECT_NE(ReadBytes(file).find("\"token-0\""), std::string::npos);
  ASSERT_TRUE(sessions.Begin(token, "p").ok());
  EXPECT_EQ(ReadBytes(file).find("\"token-0\""), std::string::npos);
  EXPECT_NE(ReadBytes(file).find("\"token-1\""), std::string::npos);
}

TEST_F(BrowserSessionsTest, WhoTriesTooOftenIsToldWhenToComeAgain) {
  BrowserSessions sessions = Make();
  EXPECT_EQ(sessions.Begin("", "p").status(), absl::UnauthenticatedError("token: it is missing"));
  for (int k = 0; k < 10; ++k) (void)sessions.Begin("wrong", "p");
  EXPECT_EQ(sessions.Begin("wrong", "p").status(),
            absl::ResourceExhaustedError("too many wrong tokens came from here; retry after 6000 ms"));
  now_ns_ += int64_t{5'990} * 1'000'000;
  EXPECT_EQ(sessions.Begin("wrong", "p").status().code(), absl::StatusCode::kResourceExhausted);
  now_ns_ += int64_t{20} * 1'000'000;
  EXPECT_EQ(sessions.Begin("wrong", "p").status().code(), absl::StatusCode::kUnauthenticated);
  EXPECT_EQ(sessions.Begin("wrong", "p").status().code(), absl::StatusCode::kResourceExhausted);
  // Ten again after a minute, not more after an hour.
  now_ns_ += kHour_ns;
  for (int k = 0; k < 10; ++k)
    EXPECT_EQ(sessions.Begin("wrong", "p").status().code(), absl::StatusCode::kUnauthenticated) << k;
  EXPECT_EQ(sessions.Begin("wrong", "p").status().code(), absl::StatusCode::kResourceExhausted);
}

TEST_F(BrowserSessionsTest, EndsForTheNextDaemonAsWell) {
  const std::string token = NewToken("anna");
  BrowserSessions sessions = Make();
  const std::string first = sessions.Begin(token, "p")->id, second = sessions.Begin(token, "p")->id;
  sessions.End("nobody's");
  sessions.End(second);
  EXPECT_TRUE(Make().Find(first).ok());
  EXPECT_FALSE(Make().Find(second).ok());
}

}  // namespace
}  // namespace weft
