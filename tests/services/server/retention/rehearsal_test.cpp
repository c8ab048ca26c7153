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

TEST(Rehearsal, StepsAndNotesAreWhole) {
  v1::RetentionRules rules;
  rules.set_keep_takes_days(3);
  rules.set_keep_trash_days(1);
  rules.set_keep_jobs_days(4);
  const auto age_s = [](const Holding& holding) { return -static_cast<double>(holding.since_unix_ns) / 1e9; };
  const RetentionPlan plan = RehearseRetention(
      rules, {TakeOf("a", 2), HeldSince(v1::HOLDING_KIND_JOB, "j", 3, 2)}, {}, age_s, 2 * kLongDay_s);
  std::vector<std::string> told;
  for (const RetentionStep& step : plan.steps) {
    told.push_back(absl::StrCat(HoldingWords(step.kind), " ", step.id, " since ",
                                step.since_unix_ns / 1'000'000'000, ": ", step.because, ", in ",
                                step.due_in_s));
  }
  EXPECT_THAT(told,
              ElementsAre("take a since -172800: it ended more than 3 days ago, in 86400",
                          "job j since -259200: it ended more than 4 days ago, in 86400",
                          "take in the trash a since 86400: it was in the trash for 1 days, in 172800"));
  EXPECT_THAT(plan.notes, IsEmpty());
}

TEST(Rehearsal, NotesAreToldOnce) {
  v1::RetentionRules rules;
  rules.set_least_free_gib(25);
  rules.set_keep_takes_days(60);
  const auto age_s = [](const Holding& holding) { return -static_cast<double>(holding.since_unix_ns) / 1e9; };
  const DiskRoom room{15 * kBytesOfGib, 400 * static_cast<int64_t>(kBytesOfGib)};
  const RetentionPlan plan = RehearseRetention(rules, {TakeOf("a", 59), TakeOf("b", 58.5)}, room, age_s, 5e5);
  EXPECT_EQ(plan.steps.size(), 2u);
  EXPECT_THAT(plan.notes,
              ElementsAre("the disk has 15.00 GiB free, less than 25, and takes did not take the last "
                          "10.00: none goes for them"));
}

TEST(Rehearsal, WhatWasRemovedIsFree) {
  v1::RetentionRules rules;
  rules.set_least_free_gib(25);
  const auto age_s = [](const Holding& holding) { return -static_cast<double>(holding.since_unix_ns) / 1e9; };
  const DiskRoom room{20 * kBytesOfGib, 40 * static_cast<int64_t>(kBytesOfGib)};
  const RetentionPlan plan = RehearseRetention(rules, {TrashOf("a", 8), TakeOf("t", 50)}, room, age_s, 0);
  EXPECT_EQ(plan.steps.size(), 1u);
  EXPECT_THAT(plan.notes, IsEmpty());
}

}  // namespace
}  // namespace weft
