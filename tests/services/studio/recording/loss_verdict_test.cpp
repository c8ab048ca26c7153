#include "services/studio/recording/loss_verdict.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

v1::TakeInfo InfoOf(uint64_t sets, uint64_t complete, uint64_t dropped) {
  v1::TakeInfo info;
  info.set_sets(sets);
  info.set_sets_complete(complete);
  info.set_sets_dropped(dropped);
  return info;
}

void AddLoss(v1::TakeInfo& info, const std::string& camera, const std::string& cause, uint64_t count) {
  v1::TakeCause& added = *info.add_causes();
  added.set_camera(camera);
  added.set_cause(cause);
  added.set_count(count);
}

TEST(LossVerdict, OfATakeWithoutSetsIsBad) {
  v1::TakeInfo info;
  AssessLosses(info);
  EXPECT_EQ(info.verdict().grade(), v1::GRADE_BAD);
  EXPECT_EQ(info.verdict().reason(), "the take holds no frame set");
  EXPECT_THAT(info.verdict().remedy(), HasSubstr("is there a trigger?"));
  EXPECT_EQ(info.verdict().checks_size(), 0);
}

TEST(LossVerdict, CountsDroppedSetsAmongAll) {
  v1::TakeInfo info = InfoOf(90, 90, 10);
  AssessLosses(info);
  EXPECT_EQ(info.verdict().grade(), v1::GRADE_USABLE);
  EXPECT_EQ(info.verdict().reason(), "90 of 100 frame sets have all cameras");
  ASSERT_EQ(info.verdict().checks_size(), 1);
  EXPECT_EQ(info.verdict().checks(0).value(), "90.0 %");
}

TEST(LossVerdict, IsGradedByTheShareOfCompleteSets) {
  for (const auto& [complete, grade] : std::vector<std::pair<uint64_t, v1::Grade>>{{1000, v1::GRADE_GOOD},
                                                                                   {990, v1::GRADE_GOOD},
                                                                                   {989, v1::GRADE_USABLE},
                                                                                   {900, v1::GRADE_USABLE},
                                                                                   {899, v1::GRADE_BAD}}) {
    v1::TakeInfo info = InfoOf(1000, complete, 0);
    AssessLosses(info);
    EXPECT_EQ(info.verdict().grade(), grade) << complete;
    EXPECT_EQ(info.verdict().remedy().empty(), grade == v1::GRADE_GOOD) << complete;
  }
}

TEST(LossVerdict, SaysThatAllSetsAreComplete) {
  v1::TakeInfo one = InfoOf(1, 1, 0);
  AssessLosses(one);
  EXPECT_EQ(one.verdict().reason(), "the one frame set has all cameras");
  v1::TakeInfo many = InfoOf(1200, 1200, 0);
  AssessLosses(many);
  EXPECT_EQ(many.verdict().reason(), "all 1,200 frame sets have all cameras");
  v1::TakeInfo none = InfoOf(1, 0, 0);
  AssessLosses(none);
  EXPECT_EQ(none.verdict().reason(), "0 of 1 frame sets have all cameras");
}

TEST(LossVerdict, NamesTheGreatestLossAndItsRemedy) {
  v1::TakeInfo info = InfoOf(100, 95, 0);
  AddLoss(info, "c01", "3 packets lost", 2);
  AddLoss(info, "c02", "the camera is disconnected", 4);
  AddLoss(info, "", "disk too slow: the queue of 2 MiB is full", 3);
  AssessLosses(info);
  EXPECT_THAT(info.verdict().reason(), StartsWith("95 of 100 frame sets have all cameras; c02: 4 frames"));
  EXPECT_THAT(info.verdict().remedy(), StartsWith("Look after power and cable of the camera"));
  // Of two that are as great, the first.
  v1::TakeInfo alike = InfoOf(100, 95, 0);
  AddLoss(alike, "c01", "3 packets lost", 3);
  AddLoss(alike, "c02", "the camera is disconnected", 3);
  AssessLosses(alike);
  EXPECT_THAT(alike.verdict().remedy(), StartsWith("Use jumbo frames"));
}

TEST(LossVerdict, KnowsARemedyForEveryCauseThatTheLedgerHas) {
  for (const auto& [cause, remedy] : std::vector<std::pair<std::string, std::string>>{
           {"the camera is disconnected", "power and cable"},
           {"it does not answer", "power and cable"},
           {"disk too slow: the queue is full", "a faster disk"},
           {"c01.stream: File too large", "ulimit -f"},
           {"the recording stopped", "Make room on the disk"},
           {"3 packets lost", "jumbo frames"},
           {"2.4 ms late (tolerance 2 ms)", "a larger `tolerance_ms`"},
           {"its times are not those of the other cameras", "what sets that camera's clock, or give it"},
           {"its times contradict their arrival", "its PTP master, or a program"},
           {"nothing of it arrived", "jumbo frames"},
           {"no frame within 100 ms", "load of its link"},
           {"no camera delivered a frame", "Is there a trigger?"},
           {"no frame at this trigger", "gets the trigger and keeps its rate"},
           {"the video begins later", "weft take trim"},
           {"the video has ended", "weft take import --offset"},
           {"the video is damaged at this time", "Copy the video again"},
           {"the video has no frame at this time", "Film at a fixed rate"}}) {
    v1::TakeInfo info = InfoOf(100, 95, 0);
    AddLoss(info, "c01", cause, 5);
    AssessLosses(info);
    EXPECT_THAT(info.verdict().remedy(), HasSubstr(remedy)) << cause;
  }
}

TEST(LossVerdict, OfACauseThatNobodyKnowsSendsToTheDoctor) {
  v1::TakeInfo named = InfoOf(100, 95, 0);
  AddLoss(named, "c07", "sunspots", 5);
  AssessLosses(named);
  EXPECT_EQ(named.verdict().remedy(),
            "Look after camera c07 (`weft doctor --session FILE`), and record again.");
  v1::TakeInfo of_all = InfoOf(100, 95, 0);
  AddLoss(of_all, "", "sunspots", 5);
  AssessLosses(of_all);
  EXPECT_EQ(of_all.verdict().remedy(),
            "Look after its cameras (`weft doctor --session FILE`), and record again.");
}

}  // namespace
}  // namespace weft
