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

}  // namespace
}  // namespace weft
