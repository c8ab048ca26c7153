#include "services/server/retention/retention_plan.h"

#include <gmock/gmock.h>

#include "absl/strings/str_cat.h"
#include "tests/services/server/retention/spans_of_time.h"

namespace weft {
namespace {

constexpr double kDay_s = 24 * 3600;

// `since_unix_ns` has the age in seconds here.
Holding Of(v1::HoldingKind kind, const std::string& id, double days_old, uint64_t gib = 10) {
  Holding holding;
  holding.kind = kind;
  holding.id = id;
  holding.since_unix_ns = static_cast<int64_t>(-days_old * kDay_s);
  holding.bytes = gib * kGib;
  return holding;
}
Holding Take(const std::string& id, double days_old, uint64_t gib = 10) {
  return Of(v1::HOLDING_KIND_TAKE, id, days_old, gib);
}
Holding Trash(const std::string& id, double days_old, uint64_t gib = 10) {
  return Of(v1::HOLDING_KIND_TRASH, id, days_old, gib);
}
Holding Kept(Holding holding) {
  holding.kept = true;
  return holding;
}

struct Words {
  std::vector<std::string> steps;  // "trash ID" and "remove ID"
  std::vector<std::string> notes;
};

double AgeOf(const Holding& holding) { return -static_cast<double>(holding.since_unix_ns); }

Words Plan(const v1::RetentionRules& rules, const std::vector<Holding>& holdings, DiskRoom room = {}) {
  Words words;
  const RetentionPlan plan = PlanRetention(rules, holdings, room, AgeOf);
  for (const RetentionStep& step : plan.steps) {
    words.steps.push_back(absl::StrCat(step.to_trash ? "trash " : "remove ", step.id));
    EXPECT_FALSE(step.because.empty());
  }
  words.notes = plan.notes;
  return words;
}

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

TEST(RetentionPlan, KeepsAllTakesAndJobsUnlessToldOtherwise) {
  EXPECT_THAT(Plan({}, {Take("a", 5000), Of(v1::HOLDING_KIND_JOB, "j", 5000), Trash("b", 6.9)}, {0, 0}).steps,
              IsEmpty());
  EXPECT_THAT(Plan({}, {Take("a", 5000), Trash("b", 7.1)}, {0, 0}).steps, ElementsAre("remove b"));
}

TEST(RetentionPlan, EachKindHasItsAge) {
  v1::RetentionRules rules = DefaultRules();
  rules.set_keep_takes_days(30);
  rules.set_keep_jobs_days(10);
  const std::vector<Holding> holdings = {
      Take("young", 29),
      Take("old", 31),
      Kept(Take("pinned", 500)),
      Of(v1::HOLDING_KIND_JOB, "young job", 9),
      Of(v1::HOLDING_KIND_JOB, "job", 11),
      Kept(Of(v1::HOLDING_KIND_JOB, "read job", 11)),
      Of(v1::HOLDING_KIND_OPERATION, "young operation", 6),
      Of(v1::HOLDING_KIND_OPERATION, "operation", 8),
      Of(v1::HOLDING_KIND_UPLOAD, "young upload", 6),
      Of(v1::HOLDING_KIND_UPLOAD, "upload", 8),
      Of(v1::HOLDING_KIND_NOTICE, "young notice", 2),
      Of(v1::HOLDING_KIND_NOTICE, "notice", 4),
  };
  EXPECT_THAT(Plan(rules, holdings).steps, UnorderedElementsAre("trash old", "remove job", "remove operation",
                                                                "remove upload", "remove notice"));
}

TEST(RetentionPlan, AQuotaTakesTheTrashFirstThenTheOldestThatAreNotKept) {
  v1::RetentionRules rules = DefaultRules();
  const std::vector<Holding> takes = {Take("b", 2), Kept(Take("a", 9)), Take("c", 1), Trash("y", 1),
                                      Trash("x", 2)};
  rules.set_takes_quota_gib(25);
  EXPECT_THAT(Plan(rules, takes).steps, ElementsAre("remove x", "remove y", "trash b"));
  rules.set_takes_quota_gib(45);
  EXPECT_THAT(Plan(rules, takes).steps, ElementsAre("remove x"));
  rules.set_takes_quota_gib(50);
  EXPECT_THAT(Plan(rules, takes).steps, IsEmpty());
}

// For want of room nothing is lost in less than an hour.
TEST(RetentionPlan, YoungTrashStaysAndCounts) {
  v1::RetentionRules rules = DefaultRules();
  rules.set_takes_quota_gib(15);
  const double half_an_hour = 0.5 / 24;
  EXPECT_THAT(Plan(rules, {Take("a", 2), Trash("x", half_an_hour)}).steps, IsEmpty());
  EXPECT_THAT(Plan(rules, {Take("a", 2), Take("b", 1), Trash("x", half_an_hour)}).steps,
              ElementsAre("trash a"));
  rules.set_least_trash_hours(0);
  EXPECT_THAT(Plan(rules, {Take("a", 2), Trash("x", half_an_hour)}).steps, ElementsAre("remove x"));
}

TEST(RetentionPlan, NothingGoesWhereAllWouldNotDo) {
  v1::RetentionRules rules = DefaultRules();
  rules.set_takes_quota_gib(5);
  const Words words = Plan(rules, {Kept(Take("a", 9)), Take("b", 1), Trash("x", 2)});
  EXPECT_THAT(words.steps, IsEmpty());
  EXPECT_THAT(words.notes, ElementsAre(HasSubstr("nothing goes")));
}

// 100 GiB should be free; takes and free room had `reach` together when they were.
DiskRoom Disk(uint64_t free_gib, int64_t reach_gib) {
  return {free_gib * kGib, reach_gib * static_cast<int64_t>(kGib)};
}

TEST(RetentionPlan, RoomThatTakesTookIsMadeByTakes) {
  v1::RetentionRules rules = DefaultRules();
  rules.set_least_free_gib(100);
  const std::vector<Holding> takes = {Take("a", 9), Take("b", 2), Trash("x", 1)};
  EXPECT_THAT(Plan(rules, takes, Disk(100, 130)).steps, IsEmpty());
  EXPECT_THAT(Plan(rules, takes, Disk(95, 125)).steps, ElementsAre("remove x"));
  EXPECT_THAT(Plan(rules, takes, Disk(85, 115)).steps, ElementsAre("remove x", "trash a"));
  // What goes by age counts.
  EXPECT_THAT(Plan(rules, {Take("a", 9), Trash("x", 8)}, Disk(95, 115)).steps, ElementsAre("remove x"));
}

TEST(RetentionPlan, RoomThatOthersTookCostsNoTake) {
  v1::RetentionRules rules = DefaultRules();
  rules.set_least_free_gib(100);
  const std::vector<Holding> takes = {Take("a", 9), Take("b", 2), Trash("x", 1)};
  // Takes had 30 of a reach of 200 before; uploads, results or another program took the rest.
  const Words words = Plan(rules, takes, Disk(0, 200));
  EXPECT_THAT(words.steps, IsEmpty());
  EXPECT_THAT(words.notes, ElementsAre(HasSubstr("takes did not take")));
  EXPECT_THAT(Plan(rules, takes, {0, -1}).steps, IsEmpty());  // nobody knows who
  // 5 GiB are theirs: as much goes.
  EXPECT_THAT(Plan(rules, takes, Disk(0, 125)).steps, ElementsAre("remove x"));
}

TEST(RetentionPlan, TheReachIsThatOfTheLastLookWithEnoughRoom) {
  v1::RetentionRules rules = DefaultRules();
  EXPECT_EQ(TakesReachAfter(rules, {Take("a", 1)}, Disk(500, -1)), -1);
  rules.set_least_free_gib(100);
  const auto reach = [&](DiskRoom room) {
    return TakesReachAfter(rules, {Take("a", 1), Trash("b", 1), Of(v1::HOLDING_KIND_JOB, "j", 1)}, room) /
           static_cast<int64_t>(kGib);
  };
  EXPECT_EQ(reach(Disk(500, 7)), 520);
  EXPECT_EQ(reach(Disk(50, 300)), 300);
  EXPECT_EQ(reach({50 * kGib, -1}), 120);  // as if takes had been in order
  EXPECT_EQ(TakesReachAfter(rules, {Take("a", 1)}, {UINT64_MAX, 7}), 7);
}

// A disk that lacked room when the rule came into force: no takes took it, whatever the rule says in bytes.
TEST(RetentionPlan, PartsOfBytesCostNoTake) {
  const std::vector<Holding> takes = {Take("a", 2), Take("b", 1)};
  v1::RetentionRules rules = DefaultRules();
  for (int tenths = 11; tenths < 1000; ++tenths) {
    rules.set_least_free_gib(tenths / 10.0);
    for (const uint64_t free_bytes : {uint64_t{0}, kGib, kGib + 1}) {
      const DiskRoom room{free_bytes, TakesReachAfter(rules, takes, {free_bytes, -1})};
      EXPECT_THAT(Plan(rules, takes, room).steps, IsEmpty()) << rules.least_free_gib();
    }
  }
}

// All that steps say, with their sizes in GiB.
std::vector<std::string> Told(const v1::RetentionRules& rules, const std::vector<Holding>& holdings,
                              DiskRoom room = {}) {
  std::vector<std::string> told;
  const RetentionPlan plan = PlanRetention(rules, holdings, room, AgeOf);
  for (const RetentionStep& step : plan.steps) {
    told.push_back(absl::StrCat(HoldingWords(step.kind), " ", step.id, " of ", -step.since_unix_ns, " s, ",
                                step.bytes / kGib, " GiB", step.to_trash ? " to the trash: " : ": ",
                                step.because));
  }
  for (const std::string& note : plan.notes) told.push_back(note);
  return told;
}

TEST(RetentionPlan, StepsByAgeSayWhatGoesAndWhy) {
  v1::RetentionRules rules;
  rules.set_keep_takes_days(30);
  rules.set_keep_jobs_days(10);
  EXPECT_THAT(
      Told(rules, {Take("t", 30, 1), Trash("x", 7, 2), Of(v1::HOLDING_KIND_JOB, "j", 10, 3),
                   Of(v1::HOLDING_KIND_OPERATION, "o", 7, 4), Of(v1::HOLDING_KIND_UPLOAD, "u", 7, 5),
                   Of(v1::HOLDING_KIND_NOTICE, "n", 3, 0), Of(v1::HOLDING_KIND_UNSPECIFIED, "?", 9000)}),
      ElementsAre("take t of 2592000 s, 1 GiB to the trash: it ended more than 30 days ago",
                  "take in the trash x of 604800 s, 2 GiB: it was in the trash for 7 days",
                  "job j of 864000 s, 3 GiB: it ended more than 10 days ago",
                  "operation o of 604800 s, 4 GiB: it ended more than 7 days ago",
                  "upload u of 604800 s, 5 GiB: nothing came for 7 days",
                  "notice n of 259200 s, 0 GiB: nobody took it for 3 days"));
}

TEST(RetentionPlan, StepsForRoomSayWhichRule) {
  v1::RetentionRules rules;
  rules.set_takes_quota_gib(20);
  const std::vector<Holding> takes = {Take("a", 9), Trash("y", 1), Trash("x", 2)};
  // Exactly one is too much.
  EXPECT_THAT(Told(rules, takes),
              ElementsAre("take in the trash x of 172800 s, 10 GiB: takes and trash have more than 20 GiB"));
  rules.set_least_free_gib(100);
  EXPECT_THAT(Told(rules, takes, Disk(90, 120)),  // both rules want 10 GiB
              ElementsAre("take in the trash x of 172800 s, 10 GiB: takes and trash have more than 20 GiB"));
  rules.set_takes_quota_gib(0);
  EXPECT_THAT(
      Told(rules, takes, Disk(90, 120)),
      ElementsAre("take in the trash x of 172800 s, 10 GiB: takes left less than 100 GiB of the disk free"));
  EXPECT_THAT(
      Told(rules, takes, Disk(70, 105)),
      ElementsAre(
          "take in the trash x of 172800 s, 10 GiB: takes left less than 100 GiB of the disk free",
          "take in the trash y of 86400 s, 10 GiB: takes left less than 100 GiB of the disk free",
          "take a of 777600 s, 10 GiB to the trash: takes left less than 100 GiB of the disk free",
          "the disk has 70.00 GiB free, less than 100, and takes did not take the last 5.00: none goes "
          "for them"));
}

TEST(RetentionPlan, NotesSayHowMuchIsMissing) {
  v1::RetentionRules rules;
  rules.set_takes_quota_gib(5);
  const std::vector<Holding> takes = {Kept(Take("a", 9)), Take("b", 1), Trash("x", 2)};
  EXPECT_THAT(
      Told(rules, takes),
      ElementsAre("takes and trash have more than 5 GiB, but nothing goes: 25.00 GiB would have to, and "
                  "all that is neither pinned nor in use has 20.00"));
  rules.set_takes_quota_gib(10);  // all of it is just enough
  EXPECT_THAT(Plan(rules, takes).steps, ElementsAre("remove x", "trash b"));
  rules.set_takes_quota_gib(0);
  rules.set_least_free_gib(100);
  EXPECT_THAT(
      Told(rules, takes, Disk(40, 200)),
      ElementsAre("the disk has 40.00 GiB free, less than 100, and takes did not take the last 60.00: "
                  "none goes for them"));
  EXPECT_THAT(Told(rules, takes, Disk(100, 0)), IsEmpty());
}

TEST(RetentionPlan, WhatGoesByAgeCountsForTheQuota) {
  v1::RetentionRules rules;
  rules.set_takes_quota_gib(10);
  EXPECT_THAT(Plan(rules, {Take("a", 9), Trash("x", 8)}).steps, ElementsAre("remove x"));
  rules.set_keep_takes_days(30);
  EXPECT_THAT(Plan(rules, {Take("old", 31), Take("b", 9)}).steps, ElementsAre("trash old"));
  // Equal times go by their ids, and other kinds have no part in it.
  EXPECT_THAT(Plan(rules, {Take("c", 9), Take("b", 9), Of(v1::HOLDING_KIND_UPLOAD, "u", 1)}).steps,
              ElementsAre("trash b"));
  const double an_hour = 1.0 / 24;
  EXPECT_THAT(Plan(rules, {Take("a", 2), Trash("x", an_hour)}).steps, ElementsAre("remove x"));
}

TEST(RetentionRules, HaveDefaultsWhereNothingIsSaid) {
  EXPECT_EQ(DefaultRules().ShortDebugString(),
            "keep_takes_days: 0 keep_trash_days: 7 keep_jobs_days: 0 takes_quota_gib: 0 least_free_gib: 0 "
            "least_trash_hours: 1 keep_uploads_days: 7 keep_notices_days: 3");
  v1::RetentionRules some;
  some.set_keep_trash_days(0);
  some.set_keep_jobs_days(5);
  EXPECT_EQ(WithDefaults(some).keep_trash_days(), 0);
  EXPECT_EQ(WithDefaults(some).keep_notices_days(), 3);
  EXPECT_EQ(KeepDays(some, v1::HOLDING_KIND_TRASH), 0);
  EXPECT_EQ(KeepDays(some, v1::HOLDING_KIND_OPERATION), 0);
  EXPECT_EQ(KeepDays(some, v1::HOLDING_KIND_JOB), 5);
  EXPECT_EQ(KeepDays(some, v1::HOLDING_KIND_TAKE), std::nullopt);
  EXPECT_EQ(KeepDays({}, v1::HOLDING_KIND_UPLOAD), 7);
  EXPECT_EQ(KeepDays({}, v1::HOLDING_KIND_NOTICE), 3);
  EXPECT_EQ(KeepDays({}, v1::HOLDING_KIND_UNSPECIFIED), std::nullopt);
  EXPECT_STREQ(HoldingWords(v1::HOLDING_KIND_UNSPECIFIED), "thing");
}

TEST(RetentionPlan, TheReachCountsToTheLastByte) {
  v1::RetentionRules rules;
  rules.set_least_free_gib(100);
  EXPECT_EQ(TakesReachAfter(rules, {Take("a", 1)}, {100 * kGib, 7}), static_cast<int64_t>(110 * kGib));
  EXPECT_EQ(TakesReachAfter(rules, {Take("a", 1)}, {100 * kGib - 1, 7}), 7);
  EXPECT_EQ(TakesReachAfter(rules, {Take("a", 1)}, {0, 0}), 0);
}

}  // namespace
}  // namespace weft
