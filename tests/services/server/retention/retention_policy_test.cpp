#include "services/server/retention/retention_policy.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <random>

#include "absl/strings/str_cat.h"
#include "tests/services/server/retention/spans_of_time.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const std::set<v1::HoldingKind> kTakes = {v1::HOLDING_KIND_TAKE, v1::HOLDING_KIND_TRASH};

// A daemon's retention beside a host whose clock may be wrong.
class PolicyTest : public ::testing::Test {
 protected:
  int64_t Unix() const { return 20'000 * kDay_ns + true_ns_ + clock_error_ns_; }
  Holding Trash(const std::string& id) const {
    Holding holding;
    holding.kind = v1::HOLDING_KIND_TRASH;
    holding.id = id;
    holding.since_unix_ns = Unix();
    holding.bytes = 10 * kGib;
    return holding;
  }
  void Restart() {
    policy_.emplace(rules_, policy_ ? policy_->State() : v1::RetentionState());
    policy_->PassTime(Unix(), true_ns_);
  }
  // Ids, in order.
  std::vector<std::string> Look(uint64_t free_bytes = UINT64_MAX) {
    told_ = policy_->PassTime(Unix(), true_ns_);
    std::vector<std::string> ids;
    for (const RetentionStep& step : policy_->Due(kTakes, holdings_, free_bytes).steps)
      ids.push_back(absl::StrCat(step.to_trash ? "trash " : "remove ", step.id));
    return ids;
  }
  void Pass(int64_t ns) {
    for (const int64_t end = true_ns_ + ns; true_ns_ < end;) {
      true_ns_ = std::min(end, true_ns_ + kMinute_ns);
      policy_->PassTime(Unix(), true_ns_);
    }
  }

  v1::RetentionRules rules_;
  std::optional<RetentionPolicy> policy_;
  std::vector<Holding> holdings_;
  int64_t true_ns_ = 0, clock_error_ns_ = 0;
  std::string told_;
};

TEST_F(PolicyTest, DoesAtTheSecondLookWhatWasDueAtTheFirst) {
  Restart();
  holdings_ = {Trash("a")};
  Pass(7 * kDay_ns + kMinute_ns);
  EXPECT_THAT(Look(), IsEmpty());
  EXPECT_THAT(Look(), ElementsAre("remove a"));
}

TEST_F(PolicyTest, AStartDestroysNothingAtItsFirstLook) {
  Restart();
  holdings_ = {Trash("a")};
  Pass(8 * kDay_ns);
  Look();
  Restart();
  EXPECT_THAT(Look(), IsEmpty());
  EXPECT_THAT(Look(), ElementsAre("remove a"));
}

TEST_F(PolicyTest, AJumpMakesNothingOldAndSaysSo) {
  Restart();
  holdings_ = {Trash("a")};
  Pass(kHour_ns);
  Look();
  clock_error_ns_ = 400 * kDay_ns;
  Pass(1);
  EXPECT_THAT(policy_->PassTime(Unix(), true_ns_), IsEmpty());  // told once
  for (int look = 0; look < 20; ++look) {
    EXPECT_THAT(Look(), IsEmpty());
    Pass(kMinute_ns);
  }
  clock_error_ns_ = 0;
  Look();
  EXPECT_THAT(told_, HasSubstr("went back by 400.00 days"));
  // What was due is due at the second look after it.
  Pass(7 * kDay_ns);
  Look();
  EXPECT_THAT(Look(), ElementsAre("remove a"));
  clock_error_ns_ = kDay_ns;
  EXPECT_THAT(Look(), IsEmpty());
  EXPECT_THAT(Look(), ElementsAre("remove a"));
}

TEST_F(PolicyTest, AWrongClockAtTheStartDestroysNothing) {
  Restart();
  holdings_ = {Trash("a")};
  Pass(kHour_ns);
  for (const int64_t error_ns : {400 * kDay_ns, -400 * kDay_ns, 8 * kDay_ns, int64_t{0}}) {
    clock_error_ns_ = error_ns;
    Restart();
    for (int look = 0; look < 10; ++look) {
      EXPECT_THAT(Look(), IsEmpty()) << error_ns / kDay_ns;
      Pass(kMinute_ns);
    }
  }
}

// Deleted just after the clock was set back by 8 days, and before anybody looked.
TEST_F(PolicyTest, WhatIsDatedByAClockThatWasJustSetIsYoung) {
  Restart();
  Pass(10 * kDay_ns);
  Look();
  clock_error_ns_ = -8 * kDay_ns;
  holdings_ = {Trash("a")};
  for (int look = 0; look < 60; ++look) {
    EXPECT_THAT(Look(), IsEmpty());
    Pass(kMinute_ns);
  }
  Pass(7 * kDay_ns);
  Look();
  EXPECT_THAT(Look(), ElementsAre("remove a"));
}

TEST_F(PolicyTest, NewRulesAreGivenTime) {
  Restart();
  holdings_ = {Trash("a")};
  Pass(kDay_ns);
  EXPECT_THAT(Look(), IsEmpty());
  rules_.set_keep_trash_days(0);
  policy_->SetRules(rules_);
  EXPECT_THAT(Look(), IsEmpty());
  EXPECT_THAT(Look(), ElementsAre("remove a"));
}

TEST_F(PolicyTest, OnesOwnGrowthIsKnownFromLookToLook) {
  rules_.set_least_free_gib(100);
  Restart();
  holdings_ = {Trash("x")};
  Pass(2 * kHour_ns);
  EXPECT_THAT(Look(150 * kGib), IsEmpty());
  // An upload of 100 GiB.
  EXPECT_THAT(Look(50 * kGib), IsEmpty());
  EXPECT_THAT(Look(50 * kGib), IsEmpty());
  Restart();
  EXPECT_THAT(Look(50 * kGib), IsEmpty());
  EXPECT_THAT(Look(50 * kGib), IsEmpty());
  // Then it goes, and a take comes.
  EXPECT_THAT(Look(150 * kGib), IsEmpty());
  Holding take = Trash("take");
  take.kind = v1::HOLDING_KIND_TAKE;
  take.bytes = 60 * kGib;
  holdings_.push_back(take);
  EXPECT_THAT(Look(90 * kGib), IsEmpty());
  EXPECT_THAT(Look(90 * kGib), ElementsAre("remove x"));
}

TEST_F(PolicyTest, ARehearsalChangesNothing) {
  Restart();
  holdings_ = {Trash("a")};
  Pass(6 * kDay_ns);
  v1::RetentionRules rules = rules_;
  EXPECT_THAT(policy_->Rehearse(rules, holdings_, UINT64_MAX, 0).steps, IsEmpty());
  EXPECT_EQ(policy_->Rehearse(rules, holdings_, UINT64_MAX, 2 * 24 * 3600).steps.size(), 1u);
  rules.set_keep_trash_days(1);
  EXPECT_EQ(policy_->Rehearse(rules, holdings_, UINT64_MAX, 0).steps.size(), 1u);
  EXPECT_THAT(Look(), IsEmpty());
  EXPECT_THAT(Look(), IsEmpty());
}

// A thousand clocks, starts and deletions: nothing goes before its days have been seen.
TEST_F(PolicyTest, NothingGoesEarly) {
  std::mt19937_64 random(11);
  const auto below = [&](int64_t most) {
    return static_cast<int64_t>(random() % static_cast<uint64_t>(most));
  };
  std::map<std::string, int64_t> seen_at_deletion;
  int64_t seen_ns = 0;  // by the truth
  int removed = 0;
  Restart();
  for (int step = 0; step < 3000; ++step) {
    const uint64_t what = random() % 10;
    if (what == 0) clock_error_ns_ += below(800 * kDay_ns) - 400 * kDay_ns;
    if (what == 1) clock_error_ns_ = 0;
    if (what == 2) {
      true_ns_ += below(20 * kDay_ns);
      Restart();
    }
    if (what >= 3) {
      const int64_t length_ns = 1 + below(10 * kHour_ns);
      Pass(length_ns);
      seen_ns += length_ns;
    }
    if (what == 3) {
      const std::string id = absl::StrCat(step);
      holdings_.push_back(Trash(id));
      seen_at_deletion[id] = seen_ns;
    }
    for (const std::string& gone : Look()) {
      const std::string id = gone.substr(gone.find(' ') + 1);
      EXPECT_GE(seen_ns - seen_at_deletion.at(id), 7 * kDay_ns - 2 * kMinute_ns) << "step " << step;
      std::erase_if(holdings_, [&](const Holding& holding) { return holding.id == id; });
      ++removed;
    }
  }
  EXPECT_GT(removed, 30);
}

TEST_F(PolicyTest, AJumpIsToldWithItsLengthAndDirection) {
  Restart();
  Pass(kHour_ns);
  const std::string rest =
      " days that nobody saw pass: nothing becomes older by it, and nothing is removed at this look";
  clock_error_ns_ = kDay_ns / 2;
  EXPECT_EQ(policy_->PassTime(Unix(), true_ns_), "the clock went forward by 0.50" + rest);
  clock_error_ns_ = -2 * kDay_ns;
  EXPECT_EQ(policy_->PassTime(Unix(), true_ns_), "the clock went back by 2.50" + rest);
  EXPECT_EQ(policy_->PassTime(Unix(), true_ns_), "");
}

TEST_F(PolicyTest, IsRememberedWhole) {
  rules_.set_least_free_gib(100);
  Restart();
  EXPECT_EQ(policy_->State().takes_reach_bytes(), -1);
  holdings_ = {Trash("a")};
  Pass(36 * kHour_ns);
  EXPECT_EQ(policy_->seen_days(), 1.5);
  Look(150 * kGib);
  const std::string begin = absl::StrCat(20'000 * kDay_ns),
                    end = absl::StrCat(20'000 * kDay_ns + 36 * kHour_ns);
  EXPECT_EQ(policy_->State().ShortDebugString(),
            absl::StrCat("periods { begin_unix_ns: ", begin, " end_unix_ns: ", end,
                         " } takes_reach_bytes: ", 160 * kGib));
  Restart();
  EXPECT_EQ(policy_->State().ShortDebugString(),
            absl::StrCat("periods { begin_unix_ns: ", begin, " end_unix_ns: ", end,
                         " } periods { begin_unix_ns: ", end, " end_unix_ns: ", end,
                         " begin_seen_ns: ", 36 * kHour_ns, " } takes_reach_bytes: ", 160 * kGib));
  EXPECT_EQ(policy_->rules().keep_trash_days(), 7) << "what is not said stands there as well";
}

TEST_F(PolicyTest, LooksAtOtherKindsChangeNothingForTakes) {
  rules_.set_least_free_gib(100);
  Restart();
  holdings_ = {Trash("a")};
  Pass(8 * kDay_ns);
  Look(150 * kGib);
  const int64_t reach_bytes = policy_->State().takes_reach_bytes();
  EXPECT_THAT(policy_->Due({v1::HOLDING_KIND_JOB}, {}, 500 * kGib).steps, IsEmpty());
  EXPECT_EQ(policy_->State().takes_reach_bytes(), reach_bytes);
  EXPECT_THAT(Look(150 * kGib), ElementsAre("remove a"));
  // One that is not due any more is asked twice again.
  holdings_[0].kept = true;
  EXPECT_THAT(Look(150 * kGib), IsEmpty());
  holdings_[0].kept = false;
  EXPECT_THAT(Look(150 * kGib), IsEmpty());
  EXPECT_THAT(Look(150 * kGib), ElementsAre("remove a"));
}

TEST_F(PolicyTest, OneThatWasDeletedAgainIsAnotherOne) {
  Restart();
  holdings_ = {Trash("a")};
  Pass(8 * kDay_ns);
  Look();
  ++holdings_[0].since_unix_ns;
  EXPECT_THAT(Look(), IsEmpty());
}

TEST_F(PolicyTest, ARehearsalKnowsWhoTookTheRoom) {
  rules_.set_least_free_gib(100);
  Restart();
  holdings_ = {Trash("x")};
  Pass(2 * kHour_ns);
  Look(150 * kGib);
  Holding take = Trash("take");
  take.kind = v1::HOLDING_KIND_TAKE;
  take.bytes = 60 * kGib;
  holdings_.push_back(take);
  const RetentionPlan plan = policy_->Rehearse(rules_, holdings_, 90 * kGib, 0);
  ASSERT_EQ(plan.steps.size(), 1u);
  EXPECT_EQ(plan.steps[0].because, "takes left less than 100 GiB of the disk free");
}

}  // namespace
}  // namespace weft
