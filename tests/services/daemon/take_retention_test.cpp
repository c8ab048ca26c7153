#include "services/daemon/take_retention.h"

#include <gmock/gmock.h>

namespace weft {
namespace {

constexpr int64_t kHour_ns = 3'600'000'000'000, kDay_ns = 24 * kHour_ns;
constexpr uint64_t kGib = uint64_t{1} << 30;
constexpr int64_t kNow_ns = 1000 * kDay_ns;

KeptTake Take(const std::string& id, double days_old, uint64_t gib = 10) {
  KeptTake take;
  take.id = id;
  take.ended_unix_ns = kNow_ns - static_cast<int64_t>(days_old * static_cast<double>(kDay_ns));
  take.bytes = gib * kGib;
  return take;
}

KeptTake Deleted(const std::string& id, double days_ago, uint64_t gib = 10) {
  KeptTake take = Take(id, 100, gib);
  take.deleted_unix_ns = kNow_ns - static_cast<int64_t>(days_ago * static_cast<double>(kDay_ns));
  return take;
}

KeptTake Kept(KeptTake take) {
  take.kept = true;
  return take;
}

// "trash ID" and "remove ID".
std::vector<std::string> Steps(const RetentionRules& rules, const std::vector<KeptTake>& takes,
                               uint64_t free_gib = 1000) {
  std::vector<std::string> words;
  for (const RetentionStep& step : PlanRetention(rules, takes, free_gib * kGib, kNow_ns)) {
    words.push_back((step.remove ? "remove " : "trash ") + step.id);
    EXPECT_FALSE(step.because.empty());
  }
  return words;
}

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(TakeRetention, KeepsAllTakesUnlessToldOtherwise) {
  EXPECT_THAT(Steps({}, {Take("a", 5000), Deleted("b", 6.9)}, 0), IsEmpty());
  EXPECT_THAT(Steps({}, {Take("a", 5000), Deleted("b", 7.1)}, 0), ElementsAre("remove b"));
}

TEST(TakeRetention, OldTakesGoThroughTheTrash) {
  RetentionRules rules;
  rules.keep_takes_days = 30;
  EXPECT_THAT(Steps(rules, {Take("young", 29), Take("old", 31), Kept(Take("pinned", 500))}),
              ElementsAre("trash old"));
}

TEST(TakeRetention, AQuotaTakesTheTrashFirstThenTheOldestThatAreNotKept) {
  RetentionRules rules;
  rules.takes_quota_gib = 25;
  const std::vector<KeptTake> takes = {Take("b", 2), Kept(Take("a", 9)), Take("c", 1), Deleted("y", 1),
                                       Deleted("x", 2)};
  EXPECT_THAT(Steps(rules, takes), ElementsAre("remove x", "remove y", "trash b", "remove b"));
  rules.takes_quota_gib = 45;
  EXPECT_THAT(Steps(rules, takes), ElementsAre("remove x"));
  rules.takes_quota_gib = 50;
  EXPECT_THAT(Steps(rules, takes), IsEmpty());
}

TEST(TakeRetention, ADiskWithLittleRoomDoesTheSame) {
  RetentionRules rules;
  rules.least_free_gib = 100;
  const std::vector<KeptTake> takes = {Take("a", 9), Take("b", 2), Deleted("x", 1)};
  EXPECT_THAT(Steps(rules, takes, 95), ElementsAre("remove x"));
  EXPECT_THAT(Steps(rules, takes, 85), ElementsAre("remove x", "trash a", "remove a"));
  EXPECT_THAT(Steps(rules, takes, 100), IsEmpty());
  // What goes by age counts.
  EXPECT_THAT(Steps(rules, {Take("a", 9), Deleted("x", 8)}, 95), ElementsAre("remove x"));
  // All that can go is not enough.
  EXPECT_THAT(Steps(rules, {Kept(Take("a", 9)), Take("b", 1)}, 0), ElementsAre("trash b", "remove b"));
}

}  // namespace
}  // namespace weft
