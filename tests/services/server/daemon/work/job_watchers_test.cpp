#include "services/server/daemon/work/job_watchers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/server/rpc/retry_after.h"
#include "tests/services/server/daemon/work/table_fixture.h"

namespace weft {
namespace {

using ::testing::SizeIs;

class JobWatchersTest : public TableFixture {
 protected:
  JobWatchers watchers_;
};

TEST_F(JobWatchersTest, SeeEachChangeOnce) {
  const JobRef job = Add(NewJob("a"), 2);
  const int64_t watcher = watchers_.Add(job, [] {});
  const JobWatchers::Updates first = watchers_.Poll(watcher);
  ASSERT_TRUE(first.update);
  EXPECT_EQ(first.update->job().id(), "a");
  EXPECT_FALSE(first.ended);
  EXPECT_FALSE(watchers_.Poll(watcher).update);

  const auto task = Begin();
  ASSERT_TRUE(task);
  FinishFrames(*task);
  const JobWatchers::Updates second = watchers_.Poll(watcher);
  ASSERT_TRUE(second.update);
  EXPECT_THAT(second.update->frames(), SizeIs(task->task.frames_size()));
  EXPECT_FALSE(watchers_.Poll(watcher).update);
}

TEST_F(JobWatchersTest, SeeTheEndAndNothingAfterIt) {
  const JobRef job = Add(NewJob("a"), 2);
  const int64_t watcher = watchers_.Add(job, [] {});
  FinishAll(job);
  Conclude(job);
  const JobWatchers::Updates last = watchers_.Poll(watcher);
  ASSERT_TRUE(last.update);
  EXPECT_TRUE(last.ended);
  EXPECT_EQ(last.update->job().state(), v1::JOB_STATE_DONE);
  EXPECT_THAT(last.update->frames(), SizeIs(2));
  EXPECT_FALSE(watchers_.Poll(watcher).update);
}

TEST_F(JobWatchersTest, AreToldOfTheirJobAlone) {
  const JobRef a = Add(NewJob("a")), b = Add(NewJob("b"));
  int told_a = 0, told_b = 0;
  const int64_t of_a = watchers_.Add(a, [&] { ++told_a; });
  watchers_.Add(b, [&] { ++told_b; });
  std::vector<std::function<void()>> calls;
  watchers_.Collect(a, &calls);
  for (const auto& call : calls) call();
  EXPECT_EQ(told_a, 1);
  EXPECT_EQ(told_b, 0);
  calls.clear();
  watchers_.CollectAll(&calls);
  EXPECT_THAT(calls, SizeIs(2));

  EXPECT_EQ(watchers_.Remove(of_a), a);
  EXPECT_EQ(watchers_.Remove(of_a), nullptr);
  EXPECT_FALSE(watchers_.AreAny(a));
  EXPECT_TRUE(watchers_.AreAny(b));
}

TEST_F(JobWatchersTest, HaveRoomForFourThousand) {
  const JobRef job = Add(NewJob("a"));
  for (int i = 0; i < 4095; ++i) watchers_.Add(job, [] {});
  EXPECT_TRUE(watchers_.CheckRoom().ok());
  const int64_t last = watchers_.Add(job, [] {});
  const absl::Status full = watchers_.CheckRoom();
  EXPECT_EQ(full.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(RetryAfter(std::string(full.message())), std::chrono::seconds(5));
  watchers_.Remove(last);
  EXPECT_TRUE(watchers_.CheckRoom().ok());
}

}  // namespace
}  // namespace weft
