#include "services/server/console/browser_sessions.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

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

}  // namespace
}  // namespace weft
