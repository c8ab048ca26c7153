#include "services/server/daemon/work/job_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

class JobStoreTest : public ::testing::Test {
 protected:
  static v1::Job JobOf(const std::string& id, v1::JobState state = v1::JOB_STATE_RUNNING) {
    v1::Job job;
    job.set_id(id);
    job.set_state(state);
    return job;
  }
  static v1::FrameInfo Frame(const std::string& name, v1::FrameState state) {
    v1::FrameInfo info;
    info.set_frame(name);
    info.set_state(state);
    return info;
  }
  std::unique_ptr<JobStore> Open() {
    auto catalogue = Catalogue::Open(folder_ / "catalogue.sqlite");
    EXPECT_TRUE(catalogue.ok()) << catalogue.status();
    return std::make_unique<JobStore>(*std::move(catalogue));
  }

  TempFolder folder_;
  const std::chrono::seconds enough_{30};
};

TEST_F(JobStoreTest, WritesWhatIsPutAndGoesOnWithIt) {
  {
    const auto store = Open();
    ASSERT_TRUE(
        store->disk().AddJob(JobOf("a", v1::JOB_STATE_QUEUED), {Frame("0", v1::FRAME_STATE_WAITING)}).ok());
    EXPECT_EQ(store->disk().AddJob(JobOf("a"), {}).code(), absl::StatusCode::kAlreadyExists);
    store->Put(JobOf("a"), {{0, Frame("0", v1::FRAME_STATE_RUNNING)}});
    store->Put(JobOf("a"), {{0, Frame("0", v1::FRAME_STATE_DONE)}, {1, Frame("1", v1::FRAME_STATE_WAITING)}});
    ASSERT_TRUE(store->Flush("a", enough_).ok());
    EXPECT_EQ(store->disk().ReadJob("a")->state(), v1::JOB_STATE_RUNNING);
    const auto frames = store->disk().ReadFrames("a");
    ASSERT_EQ(frames->size(), 2u);
    EXPECT_EQ((*frames)[0].state(), v1::FRAME_STATE_DONE);
    store->Put(JobOf("a"), {{1, Frame("1", v1::FRAME_STATE_FAILED)}});
  }
  const auto store = Open();
  EXPECT_EQ((*store->disk().ReadFrames("a"))[1].state(), v1::FRAME_STATE_FAILED)
      << "what was put before the end";
  EXPECT_EQ(store->disk().UnfinishedJobs()->size(), 1u);
  EXPECT_THAT(store->Warnings(), IsEmpty());
  EXPECT_EQ(store->Trouble(), "");
  ASSERT_TRUE(store->disk().RemoveJob("a").ok());
  EXPECT_EQ(store->disk().ReadJob("a").status().code(), absl::StatusCode::kNotFound);
}

TEST_F(JobStoreTest, TellsWhenTheLastStateIsOnTheDisk) {
  const auto store = Open();
  ASSERT_TRUE(store->disk().AddJob(JobOf("a"), {Frame("0", v1::FRAME_STATE_WAITING)}).ok());
  std::atomic<int> written = 0, refused = 0;
  store->PutLast(
      JobOf("a", v1::JOB_STATE_DONE), {Frame("0", v1::FRAME_STATE_DONE)},
      [&] {
        EXPECT_EQ(store->disk().ReadJob("a")->state(), v1::JOB_STATE_DONE);
        ++written;
      },
      [&](const std::string&) { ++refused; });
  ASSERT_TRUE(store->Flush("a", enough_).ok());
  EXPECT_EQ(written, 1);
  EXPECT_EQ(refused, 0);
  EXPECT_EQ(store->disk().EndedJobs(0, 10)->size(), 1u);
  ASSERT_TRUE(
      store->disk().UpdateAll(JobOf("a", v1::JOB_STATE_QUEUED), {Frame("0", v1::FRAME_STATE_WAITING)}).ok());
  EXPECT_EQ(store->disk().ListJobs(10, "")->front().state(), v1::JOB_STATE_QUEUED);
  store->Put(JobOf("a"), {});  // it runs again
  ASSERT_TRUE(store->Flush("a", enough_).ok());
  EXPECT_EQ(written, 1) << "once for each end";
}

TEST_F(JobStoreTest, ARowThatIsGoneIsMadeAnewAtTheEnd) {
  const auto store = Open();
  store->PutLast(
      JobOf("a", v1::JOB_STATE_DONE), {Frame("0", v1::FRAME_STATE_DONE), Frame("1", v1::FRAME_STATE_DONE)},
      [] {}, [](const std::string&) {});
  ASSERT_TRUE(store->Flush("a", enough_).ok());
  EXPECT_EQ(store->disk().ReadFrames("a")->size(), 2u);
}

TEST_F(JobStoreTest, KeepsNobodyWaitingOnceItHasStopped) {
  const auto store = Open();
  ASSERT_TRUE(store->disk().AddJob(JobOf("a"), {}).ok());
  store->Stop();
  store->Put(JobOf("a", v1::JOB_STATE_CANCELLED), {});
  const auto before = std::chrono::steady_clock::now();
  const absl::Status status = store->Flush("a", enough_);
  EXPECT_EQ(status.message(), "job a: its state cannot be written down yet");
  EXPECT_LT(std::chrono::steady_clock::now() - before, std::chrono::seconds(5));
  EXPECT_EQ(store->disk().ReadJob("a")->state(), v1::JOB_STATE_RUNNING);
}

TEST_F(JobStoreTest, WhatIsOfNoJobAnyMoreIsNotWritten) {
  const auto store = Open();
  store->Put(JobOf("a"), {});
  ASSERT_TRUE(store->Flush("a", enough_).ok());
  EXPECT_EQ(store->disk().ReadJob("a").status().code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace weft
