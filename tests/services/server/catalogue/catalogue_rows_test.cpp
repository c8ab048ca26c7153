#include "services/server/catalogue/catalogue_rows.h"

#include <gtest/gtest.h>

#include <string>

namespace weft {
namespace {

v1::Job JobForARow() {
  v1::Job job;
  job.set_id("20260101-1");
  job.set_state(v1::JOB_STATE_RUNNING);
  job.set_message("waits for room");
  return job;
}

TEST(CatalogueRows, AreReadAsTheyWereMade) {
  const JobRow row = MakeRow(JobForARow());
  EXPECT_EQ(row.id, "20260101-1");
  EXPECT_EQ(row.state, "JOB_STATE_RUNNING");
  EXPECT_EQ(row.message, "waits for room");
  const auto job = ReadRow(row);
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(job->state(), v1::JOB_STATE_RUNNING);

  v1::FrameInfo info;
  info.set_frame("0007");
  info.set_attempts(2);
  const FrameRow frame = MakeRow("j", 7, info);
  EXPECT_EQ(frame.name, "0007");
  EXPECT_EQ(frame.attempts, 2);
  ASSERT_TRUE(ReadRow(frame).ok());
  EXPECT_EQ(ReadRow(frame)->frame(), "0007");
}

// Whatever changes: what people look at, and what the message holds.
TEST(CatalogueRows, TellEveryChange) {
  JobRow row = MakeRow(JobForARow());
  row.message += "x";
  EXPECT_EQ(ReadRow(row).status().code(), absl::StatusCode::kDataLoss);
  row = MakeRow(JobForARow());
  row.job.back() ^= 1;
  EXPECT_EQ(ReadRow(row).status().code(), absl::StatusCode::kDataLoss);
  FrameRow frame = MakeRow("j", 7, {});
  frame.position = 8;
  EXPECT_EQ(ReadRow(frame).status().code(), absl::StatusCode::kDataLoss);
}

TEST(CatalogueRows, OfTheFirstVersionHaveTheirColumnsForAChecksum) {
  JobRow row = MakeRow(JobForARow());
  row.checksum = 0;
  EXPECT_FALSE(ReadRow(row).ok());
  EXPECT_TRUE(ReadRow(row, kFirstSchemaVersion).ok());
  row.state = "JOB_STATE_DONE";
  EXPECT_EQ(ReadRow(row, kFirstSchemaVersion).status().code(), absl::StatusCode::kDataLoss);
}

}  // namespace
}  // namespace weft
