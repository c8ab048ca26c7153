// Turns at workers, by a simulation of callers that wait for them.
#include "services/server/callers/turns.h"

#include <gtest/gtest.h>

#include <map>

namespace weft {
namespace {

// What each was served when one after the other had its turn; a turn takes the caller's time.
std::map<std::string, double> ServeOneByOne(Turns& turns, const std::map<std::string, double>& time_of,
                                            int count) {
  std::vector<std::string> waiting;
  for (const auto& [name, time] : time_of) waiting.push_back(name);
  std::map<std::string, double> served;
  for (int i = 0; i < count; ++i) {
    const std::string& next = waiting[turns.Next(waiting)];
    turns.Begin(next);
    turns.End(next, time_of.at(next));
    served[next] += time_of.at(next);
  }
  return served;
}

TEST(TurnsTest, TheFirstOfOneCallerIsFirst) {
  Turns turns;
  EXPECT_EQ(turns.Next({"a", "a", "a"}), 0U);
  EXPECT_EQ(turns.Next({"b", "a"}), 0U);
}

TEST(TurnsTest, ServiceIsSharedHoweverLongTurnsAre) {
  Turns turns;
  const auto served = ServeOneByOne(turns, {{"hours", 3600}, {"minutes", 60}, {"seconds", 1}}, 20'000);
  EXPECT_NEAR(served.at("minutes"), served.at("seconds"), 60);
  EXPECT_NEAR(served.at("hours"), served.at("seconds"), 3600);
}

TEST(TurnsTest, WorkersAreShared) {
  Turns turns;
  std::map<std::string, int> running;
  for (int worker = 0; worker < 6; ++worker) {
    const std::vector<std::string> waiting = {"a", "a", "b", "c"};
    const std::string& next = waiting[turns.Next(waiting)];
    turns.Begin(next);
    ++running[next];
  }
  EXPECT_EQ(running, (std::map<std::string, int>{{"a", 2}, {"b", 2}, {"c", 2}}));
}

TEST(TurnsTest, WhoComesLaterHasNoSavings) {
  Turns turns;
  ServeOneByOne(turns, {{"early", 10}}, 1000);
  // From now on they share.
  const auto served = ServeOneByOne(turns, {{"early", 10}, {"late", 10}}, 100);
  EXPECT_NEAR(served.at("early"), served.at("late"), 20);
}

TEST(TurnsTest, WhoComesBackHasNoDebtsOfLongAgo) {
  Turns turns;
  ServeOneByOne(turns, {{"a", 1}, {"b", 1}}, 1000);
  ServeOneByOne(turns, {{"b", 1}}, 10'000);
  const auto served = ServeOneByOne(turns, {{"a", 1}, {"b", 1}}, 100);
  EXPECT_NEAR(served.at("a"), served.at("b"), 2);
}

TEST(TurnsTest, TokensOfOneNameTakeOneTurn) {
  Turns turns;
  const std::vector<std::string> waiting = {"token 1 (anna)", "token 2 (anna)", "token 3 (ben)"};
  turns.Begin("token 1 (anna)");
  EXPECT_EQ(turns.Next(waiting), 2U);
}

TEST(TurnsTest, CountsWhatRuns) {
  Turns turns;
  EXPECT_EQ(turns.Running("token 1 (anna)"), 0);
  turns.Begin("token 1 (anna)");
  turns.Begin("token 2 (anna)");
  EXPECT_EQ(turns.Running("token 3 (anna)"), 2);
  turns.End("token 1 (anna)", 1);
  EXPECT_EQ(turns.Running("token 1 (anna)"), 1);
  turns.End("token 1 (anna)", 1);
  turns.End("token 1 (anna)", 1);  // one too many
  EXPECT_EQ(turns.Running("token 1 (anna)"), 0);
  // Who had less is next, and no turn makes up for another.
  turns.End("b", -100);
  EXPECT_EQ(turns.Next({"token 1 (anna)", "b"}), 1U);
  turns.End("b", 4);
  EXPECT_EQ(turns.Next({"token 1 (anna)", "b"}), 0U);
}

}  // namespace
}  // namespace weft
