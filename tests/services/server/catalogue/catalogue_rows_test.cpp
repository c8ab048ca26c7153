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

TEST(CatalogueRows, RepeatWhatTheirMessagesSay) {
  v1::FrameInfo info;
  info.set_frame("0007");
  info.set_state(v1::FRAME_STATE_FAILED);
  info.set_attempts(2);
  const FrameRow frame = MakeRow("j", 7, info);
  EXPECT_EQ(frame.job_id, "j");
  EXPECT_EQ(frame.position, 7);
  EXPECT_EQ(frame.state, "FRAME_STATE_FAILED");
  EXPECT_EQ(frame.info, info.SerializeAsString());
  EXPECT_EQ(MakeRow(JobForARow()).job, JobForARow().SerializeAsString());
  FrameRow old = frame;
  old.checksum = 0;
  EXPECT_EQ(ReadRow(old).status(),
            absl::DataLossError("the catalogue's entry of frame 7 of job j is damaged"));
  EXPECT_TRUE(ReadRow(old, kFirstSchemaVersion).ok());
  old.state = "FRAME_STATE_DONE";
  EXPECT_FALSE(ReadRow(old, kFirstSchemaVersion).ok());
  old.state = frame.state;
  old.attempts = 3;
  EXPECT_FALSE(ReadRow(old, kFirstSchemaVersion).ok());
  old.attempts = 2;
  old.info = "\xff\xff";
  EXPECT_FALSE(ReadRow(old, kFirstSchemaVersion).ok());
  JobRow job = MakeRow(JobForARow());
  job.id = "a\x01";
  EXPECT_EQ(ReadRow(job).status(), absl::DataLossError("the catalogue's entry of job a\\x01 is damaged"));
  EXPECT_FALSE(ReadRow(job, kFirstSchemaVersion).ok());
}

// Each part for itself, so that nothing can move from one to the next.
TEST(CatalogueRows, TellWhatMovedBetweenColumns) {
  JobRow row = MakeRow(JobForARow());
  row.message.insert(0, 1, row.state.back());
  row.state.pop_back();
  EXPECT_FALSE(ReadRow(row).ok());
  for (int column = 0; column < 5; ++column) {
    FrameRow frame = MakeRow("j", 7, {});
    if (column == 0) frame.job_id = "k";
    if (column == 1) frame.name = "x";
    if (column == 2) frame.state += "x";
    if (column == 3) ++frame.attempts;
    if (column == 4) frame.info += "x";
    EXPECT_FALSE(ReadRow(frame).ok()) << column;
  }
  EXPECT_EQ(JobColumns(), "sequence, id, state, message, job, checksum");
  EXPECT_EQ(JobColumns(kFirstSchemaVersion), "sequence, id, state, message, job, 0");
  EXPECT_EQ(FrameColumns(), "job_id, position, name, state, attempts, info, checksum");
  EXPECT_EQ(FrameColumns(kFirstSchemaVersion), "job_id, position, name, state, attempts, info, 0");
}

}  // namespace
}  // namespace weft
