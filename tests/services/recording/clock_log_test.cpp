#include "services/recording/clock_log.h"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

TEST(ClockLog, KeepsReadingsAndTellsOfChangesOfPtp) {
  const TempFolder folder;
  {
    ClockLog log({"left", "right"});
    ASSERT_TRUE(log.Open(folder.path()).ok());
    EXPECT_EQ(log.Add(0, {1000, -5, 3, "Uncalibrated", {}}), "");
    EXPECT_EQ(log.Add(0, {2000, -6, 2, "Slave", -40}), "PTP went from Uncalibrated to Slave");
    EXPECT_EQ(log.Add(1, {2000, 7, 2, "", {}}), "");
    EXPECT_EQ(log.Last(0)->device_minus_host_ns, -6);
  }
  std::ofstream(folder.path() + "/clocks.csv", std::ios::app) << "3000,left,1";  // cut off by a crash
  const absl::StatusOr<std::vector<LoggedReading>> readings = ReadClockLog(folder.path());
  ASSERT_TRUE(readings.ok());
  ASSERT_EQ(readings->size(), 3u);
  EXPECT_EQ((*readings)[1].camera_id, "left");
  EXPECT_EQ((*readings)[1].reading.ptp_status, "Slave");
  EXPECT_EQ((*readings)[1].reading.ptp_offset_ns, -40);
  EXPECT_EQ((*readings)[2].reading.ptp_offset_ns, std::nullopt);
  EXPECT_TRUE(absl::IsNotFound(ReadClockLog(folder.path() + "/none").status()));
}

}  // namespace
}  // namespace weft
