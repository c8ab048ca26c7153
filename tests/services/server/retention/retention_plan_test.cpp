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

}  // namespace
}  // namespace weft
