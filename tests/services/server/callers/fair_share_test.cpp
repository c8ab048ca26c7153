// What one caller may take of what there is for all.
#include "services/server/callers/fair_share.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/server/rpc/retry_after.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

constexpr ShareLimits kPlaces{.all = 1000, .of_one_caller = 300, .reserve = 50};

Caller Client(const std::string& name) { return {name, v1::ROLE_CLIENT}; }
Caller Operator(const std::string& name) { return {name, v1::ROLE_OPERATOR}; }

// How many of so many tries are let in.
int Fill(FairShare& share, const Caller& caller, int tries = 2000) {
  int taken = 0;
  for (int i = 0; i < tries && share.Check(caller).ok(); ++i, ++taken) share.Take(caller.name);
  return taken;
}

TEST(FairShareTest, OneCallerAloneHasTheMostOfOneCaller) {
  FairShare share(kPlaces, "things");
  EXPECT_EQ(Fill(share, Client("token a (greedy)")), 300);
  const absl::Status refused = share.Check(Client("token a (greedy)"));
  EXPECT_TRUE(absl::IsResourceExhausted(refused));
  EXPECT_THAT(std::string(refused.message()),
              HasSubstr("token a (greedy) has 300 things, the most of one caller"));
  EXPECT_TRUE(RetryAfter(std::string(refused.message())).has_value());
  // One that ends makes room for one.
  share.Give("token a (greedy)");
  EXPECT_EQ(Fill(share, Client("token a (greedy)")), 1);
}

TEST(FairShareTest, SmallWholesAreNotOneCallers) {
  // Half of what stays free, without the limit of one caller: a third.
  FairShare share({.all = 30}, "things");
  EXPECT_EQ(Fill(share, Client("greedy")), 10);
}

TEST(FairShareTest, AnyNumberOfGreedyCallersLeavesRoomForTheNext) {
  FairShare share(kPlaces, "things");
  for (int i = 0; i < 12; ++i) EXPECT_GE(Fill(share, Client("greedy" + std::to_string(i))), 4) << i;
  EXPECT_TRUE(share.Check(Client("modest")).ok());
  EXPECT_LE(share.taken(), 950);
}

TEST(FairShareTest, TheReserveIsForItsRole) {
  FairShare share({.all = 10, .reserve = 3}, "things");
  for (int i = 0; i < 7; ++i) share.Take("caller " + std::to_string(i));
  const absl::Status refused = share.Check(Client("modest"));
  EXPECT_TRUE(absl::IsResourceExhausted(refused));
  EXPECT_THAT(std::string(refused.message()), HasSubstr("7 of 10 things, and 3 are kept for others"));
  EXPECT_EQ(Fill(share, Operator("user weft"), 1), 1);
  FairShare of_admins({.all = 1, .reserve = 1, .reserved_for = v1::ROLE_ADMIN}, "things");
  EXPECT_FALSE(of_admins.Check(Operator("certificate stage")).ok());
  EXPECT_TRUE(of_admins.Check({"user root", v1::ROLE_ADMIN}).ok());
}

TEST(FairShareTest, TokensOfOneNameAreOneCaller) {
  FairShare share({.all = 30, .of_one_caller = 5}, "things");
  for (int i = 0; i < 5; ++i) share.Take("token " + std::to_string(i) + " (anna)");
  EXPECT_FALSE(share.Check(Client("token 9 (anna)")).ok());
  EXPECT_TRUE(share.Check(Client("token 9 (ben)")).ok());
  EXPECT_EQ(share.TakenBy("token 0 (anna)"), 5);
}

TEST(FairShareTest, CountsAmounts) {
  FairShare share({.all = 1000, .of_one_caller = 600}, "bytes");
  // The first may be as large as the limit; more only with as much left twice.
  EXPECT_TRUE(share.Check(Client("a"), 600).ok());
  EXPECT_FALSE(share.Check(Client("a"), 601).ok());
  share.Take("a", 200);
  EXPECT_TRUE(share.Check(Client("a"), 133).ok());  // 333 of 667 free
  EXPECT_FALSE(share.Check(Client("a"), 134).ok());
  share.Give("a", 199);
  EXPECT_EQ(share.TakenBy("a"), 1);
  share.Give("a", 500);  // no more than it has
  EXPECT_EQ(share.taken(), 0);
  EXPECT_EQ(share.TakenBy("a"), 0);
}

TEST(FairShareTest, RefusalsSayWhoHasWhat) {
  FairShare share({.all = 10, .of_one_caller = 3, .reserve = 2}, "jobs");
  const auto refused = [&](const Caller& caller, int64_t amount = 1) {
    const absl::Status status = share.Check(caller, amount);
    EXPECT_TRUE(absl::IsResourceExhausted(status));
    return std::string(status.message());
  };
  share.Take("a", 3);
  EXPECT_EQ(refused(Client("a")),
            "a has 3 jobs, the most of one caller; end some or wait; retry after 5000 ms");
  share.Take("b", 2);
  EXPECT_EQ(
      refused(Client("b")),
      "b has 2 jobs, and all callers together 5 of 10: the rest is for others; end some or wait; retry after "
      "5000 ms");
  share.Take("c", 3);
  EXPECT_EQ(
      refused(Client("d")),
      "all callers together have 8 of 10 jobs, and 2 are kept for others; end some or wait; retry after 5000 "
      "ms");
  share.Take("e", 2);
  EXPECT_EQ(refused(Operator("f")),
            "all callers together have 10 of 10 jobs; end some or wait; retry after 5000 ms");
  FairShare without_reserve({.all = 1}, "jobs");
  without_reserve.Take("a");
  EXPECT_EQ(std::string(without_reserve.Check(Client("b")).message()),
            "all callers together have 1 of 1 jobs; end some or wait; retry after 5000 ms");
  share.Give("nobody");
  EXPECT_EQ(share.taken(), 10);
  EXPECT_EQ(share.TakenBy("nobody"), 0);
}

TEST(FairShareTest, MayTakeMoreToTheLastOne) {
  const ShareLimits limits{.all = 12, .of_one_caller = 5, .reserve = 3};
  EXPECT_TRUE(MayTakeMore(limits, 4, 0, 5, false));   // 5 of 5 that are free
  EXPECT_FALSE(MayTakeMore(limits, 5, 0, 5, false));  // 4 are free
  EXPECT_TRUE(MayTakeMore(limits, 5, 0, 5, true));
  EXPECT_FALSE(MayTakeMore(limits, 0, 0, 6, true));
  EXPECT_TRUE(MayTakeMore(limits, 2, 2, 1, false));   // 3 of the 6 that stay free
  EXPECT_FALSE(MayTakeMore(limits, 3, 2, 1, false));  // 3 of 5
  EXPECT_FALSE(MayTakeMore(limits, 20, 0, 1, true));
}

}  // namespace
}  // namespace weft
