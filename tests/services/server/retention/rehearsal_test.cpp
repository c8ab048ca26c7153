#include "services/server/retention/rehearsal.h"

#include <gmock/gmock.h>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr uint64_t kBytesOfGib = uint64_t{1} << 30;
constexpr double kLongDay_s = 24 * 3600;

Holding HeldSince(v1::HoldingKind kind, const std::string& id, double days_old, uint64_t gib = 10) {
  return {.kind = kind,
          .id = id,
          .since_unix_ns = -static_cast<int64_t>(days_old * kLongDay_s * 1e9),
          .bytes = gib * kBytesOfGib};
}
Holding TakeOf(const std::string& id, double days_old) {
  return HeldSince(v1::HOLDING_KIND_TAKE, id, days_old);
}
Holding TrashOf(const std::string& id, double days_old) {
  return HeldSince(v1::HOLDING_KIND_TRASH, id, days_old);
}

// "trash ID in 3 h".
std::vector<std::string> Rehearse(const v1::RetentionRules& rules, const std::vector<Holding>& holdings,
                                  double ahead_days, DiskRoom room = {}) {
  std::vector<std::string> words;
  const auto age_s = [](const Holding& holding) { return -static_cast<double>(holding.since_unix_ns) / 1e9; };
  for (const RetentionStep& step :
       RehearseRetention(rules, holdings, room, age_s, ahead_days * kLongDay_s).steps) {
    words.push_back(absl::StrCat(step.to_trash ? "trash " : "remove ", step.id, " in ",
                                 static_cast<int>(step.due_in_s / 3600 + 0.5), " h"));
  }
  return words;
}

TEST(Rehearsal, TellsWhenEachIsDueInTheOrderOfTime) {
  v1::RetentionRules rules = DefaultRules();
  rules.set_keep_jobs_days(10);
  const std::vector<Holding> holdings = {TrashOf("a", 6), HeldSince(v1::HOLDING_KIND_JOB, "j", 9.5),
                                         TrashOf("b", 8)};
  EXPECT_THAT(Rehearse(rules, holdings, 0), ElementsAre("remove b in 0 h"));
  EXPECT_THAT(Rehearse(rules, holdings, 0.75), ElementsAre("remove b in 0 h", "remove j in 12 h"));
  EXPECT_THAT(Rehearse(rules, holdings, 30),
              ElementsAre("remove b in 0 h", "remove j in 12 h", "remove a in 24 h"));
}

// A longer look ahead shows what a shorter one does, and more.
TEST(Rehearsal, WhatGoesForRoomNowDoesNotWaitForItsAge) {
  v1::RetentionRules rules = DefaultRules();
  rules.set_keep_takes_days(3);
  rules.set_takes_quota_gib(15);
  const std::vector<Holding> holdings = {TakeOf("old", 2), TakeOf("new", 1)};
  EXPECT_THAT(Rehearse(rules, holdings, 0), ElementsAre("trash old in 0 h"));
  // An hour later it goes for good, and the rest is within the quota until it is old.
  EXPECT_THAT(Rehearse(rules, holdings, 10), ElementsAre("trash old in 0 h", "remove old in 1 h",
                                                         "trash new in 48 h", "remove new in 216 h"));
}

TEST(Rehearsal, RemovedTrashMakesRoom) {
  v1::RetentionRules rules = DefaultRules();
  rules.set_least_free_gib(25);
  const std::vector<Holding> holdings = {TrashOf("a", 6.9), TakeOf("t", 50)};
  // 15 GiB are free, all else is theirs: the trash is enough.
  EXPECT_THAT(Rehearse(rules, holdings, 5, {15 * kBytesOfGib, 40 * static_cast<int64_t>(kBytesOfGib)}),
              ElementsAre("remove a in 0 h"));
}

TEST(Rehearsal, KeptOnesStay) {
  v1::RetentionRules rules = DefaultRules();
  rules.set_keep_takes_days(1);
  Holding pinned = TakeOf("pinned", 50);
  pinned.kept = true;
  EXPECT_THAT(Rehearse(rules, {pinned}, 1000), IsEmpty());
}

TEST(Rehearsal, EndsWithRulesOfNoTime) {
  v1::RetentionRules rules = DefaultRules();
  rules.set_keep_trash_days(0);
  rules.set_least_trash_hours(0);
  rules.set_keep_takes_days(1e-9);
  EXPECT_THAT(Rehearse(rules, {TakeOf("a", 2), TrashOf("b", 0)}, 100),
              ElementsAre("trash a in 0 h", "remove b in 0 h", "remove a in 0 h"));
}

}  // namespace
}  // namespace weft
