#include "services/work/plan/pilot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

// 80 frames are left out: 10 before and after, 20 between the runs.
TEST(Pilot, RunsOfNeighboursAreSpreadEvenly) {
  EXPECT_THAT(PilotRuns(100, 20),
              ElementsAre(ElementsAre(10, 11, 12, 13, 14), ElementsAre(35, 36, 37, 38, 39),
                          ElementsAre(60, 61, 62, 63, 64), ElementsAre(85, 86, 87, 88, 89)));
}

TEST(Pilot, FewFramesAreOneRun) {
  EXPECT_THAT(PilotRuns(3, 20), ElementsAre(ElementsAre(0, 1, 2)));
  EXPECT_THAT(PilotRuns(9, 4), ElementsAre(ElementsAre(2, 3, 4, 5)));
  EXPECT_THAT(PilotRuns(100, 0), IsEmpty());
  EXPECT_THAT(PilotRuns(0, 20), IsEmpty());
}

v1::WorkerUsage UsageAt(double wall_s, double core_s, double delay_s = 0) {
  v1::WorkerUsage usage;
  usage.set_wall_s(wall_s), usage.set_core_s(core_s), usage.set_delay_s(delay_s);
  return usage;
}

TEST(Pilot, SharesWhatWorkersReadAmongAllFramesAndHasTheLargestOfThem) {
  PilotTask large, small, idle;
  large.finished = {UsageAt(4, 3), UsageAt(6, 5), UsageAt(9, 7)};
  large.ended = UsageAt(10, 8, 2);
  large.ended.set_peak_memory_mib(300), large.ended.set_read_mib(40), large.ended.set_written_mib(8);
  small.finished = {UsageAt(5, 4)};
  small.ended = UsageAt(6, 4, 6);
  small.ended.set_peak_memory_mib(200), small.ended.set_read_mib(20), small.ended.set_written_mib(4);
  idle.ended = UsageAt(100, 100, 100);  // it finished nothing
  idle.ended.set_peak_memory_mib(900), idle.ended.set_read_mib(900);
  const Pilot pilot = PilotFrom({idle, large, small});
  EXPECT_EQ(pilot.peak_memory_mib, 300);
  EXPECT_EQ(pilot.mib_read_per_frame, 15);
  EXPECT_EQ(pilot.mib_written_per_frame, 3);
  EXPECT_EQ(pilot.waited_share, 0.5);
  // Frames of short tasks are unlike those of long ones, and tell of no start.
  EXPECT_THAT(pilot.frame_s, ElementsAre(3));
  EXPECT_EQ(pilot.frame_core_s, 2);
  EXPECT_EQ(pilot.startup_s, 2);
  EXPECT_EQ(pilot.startup_core_s, 1);
}

TEST(Pilot, TwoFramesTellOfTheStartAndOneDoesNot) {
  PilotTask two, one;
  two.finished = {UsageAt(5, 4), UsageAt(7, 5)};
  one.finished = {UsageAt(9, 8)};
  const Pilot pilot = PilotFrom({two, one});
  EXPECT_THAT(pilot.frame_s, ElementsAre(2, 9));
  EXPECT_EQ(pilot.frame_core_s, 4.5);
  EXPECT_EQ(pilot.startup_s, 3);
  EXPECT_EQ(pilot.startup_core_s, 3);
}

TEST(Pilot, NoTimeIsNegative) {
  PilotTask task;  // its second frame took longer than its first and the start
  task.finished = {UsageAt(2, 1), UsageAt(6, 4, 1)};
  const Pilot pilot = PilotFrom({task});
  EXPECT_EQ(pilot.startup_s, 0);
  EXPECT_EQ(pilot.startup_core_s, 0);
  EXPECT_THAT(pilot.frame_s, ElementsAre(3));
  EXPECT_EQ(pilot.waited_share, 0);  // no time at all
  task.finished[1].set_delay_s(9);   // more than has passed
  EXPECT_THAT(PilotFrom({task}).frame_s, ElementsAre(0));
  EXPECT_EQ(PilotFrom({}).mib_read_per_frame, 0);
}

}  // namespace
}  // namespace weft
