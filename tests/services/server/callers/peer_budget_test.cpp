#include "services/server/callers/peer_budget.h"

#include <gtest/gtest.h>

#include <chrono>
#include <string>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

using std::chrono::seconds;

constexpr PeerBudget::Time kStart{seconds(1000)};

int Admitted(PeerBudget& budget, const std::string& peer, int connections, PeerBudget::Time now) {
  int admitted = 0;
  for (int i = 0; i < connections; ++i) admitted += budget.Admit(peer, now);
  return admitted;
}

TEST(PeerBudget, LetsABurstComeAndThenSoManyASecond) {
  PeerBudget budget;
  EXPECT_EQ(Admitted(budget, "10.0.0.5", 1000, kStart), 250);
  EXPECT_EQ(Admitted(budget, "10.0.0.5", 1000, kStart + seconds(2)), 50);
  EXPECT_EQ(Admitted(budget, "10.0.0.5", 1000, kStart + seconds(3600)), 250);
}

TEST(PeerBudget, CountsEachPeerForItself) {
  PeerBudget budget;
  Admitted(budget, "10.0.0.5", 1000, kStart);
  EXPECT_EQ(Admitted(budget, "10.0.0.6", 10, kStart), 10);
}

TEST(PeerBudget, KeepsOutWhoOffendsAgainAndAgain) {
  PeerBudget budget;
  EXPECT_FALSE(budget.Violate("10.0.0.5", 1, kStart));
  EXPECT_FALSE(budget.Violate("10.0.0.5", 1, kStart + seconds(1)));
  EXPECT_TRUE(budget.Admit("10.0.0.5", kStart + seconds(1)));
  EXPECT_TRUE(budget.Violate("10.0.0.5", 1, kStart + seconds(2)));
  EXPECT_TRUE(budget.IsKeptOut("10.0.0.5", kStart + seconds(31)));
  EXPECT_FALSE(budget.Admit("10.0.0.5", kStart + seconds(31)));
  EXPECT_FALSE(budget.IsKeptOut("10.0.0.6", kStart + seconds(3)));
  EXPECT_FALSE(budget.IsKeptOut("10.0.0.5", kStart + seconds(32)));
  EXPECT_TRUE(budget.Admit("10.0.0.5", kStart + seconds(32)));
}

TEST(PeerBudget, ForgetsOffencesOfLongAgo) {
  PeerBudget budget;
  for (int i = 0; i < 10; ++i) {
    EXPECT_FALSE(budget.Violate("10.0.0.5", 1, kStart + i * (PeerBudget::kRemembered + seconds(1))));
  }
}

TEST(PeerBudget, RemembersWhoIsKeptOutThroughAFloodOfAddresses) {
  PeerBudget budget;
  ASSERT_TRUE(budget.Violate("10.0.0.5", PeerBudget::kMostViolations, kStart));
  // Each address comes once.
  for (size_t i = 0; i < 5 * PeerBudget::kMostPeers; ++i) {
    EXPECT_TRUE(budget.Admit(absl::StrCat("fe80::", i), kStart + seconds(1)));
  }
  EXPECT_TRUE(budget.IsKeptOut("10.0.0.5", kStart + seconds(2)));
}

}  // namespace
}  // namespace weft
