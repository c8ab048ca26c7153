#include "services/work/job/job_frames.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

JobFrames MakeFrames(int count) {
  std::vector<v1::FrameInfo> infos(count);
  for (int i = 0; i < count; ++i) {
    infos[i].set_frame(std::to_string(i));
    infos[i].set_state(v1::FRAME_STATE_WAITING);
  }
  return JobFrames(infos);
}

v1::FrameInfo Result(v1::FrameState state, bool reused = false) {
  v1::FrameInfo info;
  info.set_state(state);
  info.set_reused(reused);
  return info;
}

TEST(JobFrames, ChunksShrinkTowardsTheEndAndCoverEveryFrameOnce) {
  JobFrames frames = MakeFrames(100);
  std::vector<size_t> all;
  size_t last = 1000;
  while (frames.HasWaiting()) {
    const std::vector<size_t> chunk = frames.TakeChunk(2);
    ASSERT_FALSE(chunk.empty());
    EXPECT_LE(chunk.size(), last);
    last = chunk.size();
    all.insert(all.end(), chunk.begin(), chunk.end());
  }
  EXPECT_EQ(last, 1u);
  ASSERT_EQ(all.size(), 100u);
  for (size_t i = 0; i < all.size(); ++i) EXPECT_EQ(all[i], i);
  EXPECT_THAT(frames.TakeChunk(2), IsEmpty());
  EXPECT_FALSE(frames.AllProcessed());
}

TEST(JobFrames, ACrashedFrameComesLastAndAlone) {
  JobFrames frames = MakeFrames(3);
  ASSERT_THAT(frames.TakeChunk(2), ElementsAre(0));
  frames.Start(0);
  frames.Requeue(0, JobFrames::Attempt::kCounts);
  EXPECT_EQ(frames.infos()[0].attempts(), 1);
  EXPECT_THAT(frames.TakeChunk(2), ElementsAre(1));
  EXPECT_THAT(frames.TakeChunk(2), ElementsAre(2));
  EXPECT_THAT(frames.TakeChunk(2), ElementsAre(0));
}

TEST(JobFrames, AFrameThatRanWhenTheDaemonWasKilledComesLastAndKeepsItsAttempts) {
  JobFrames frames = MakeFrames(3);
  ASSERT_THAT(frames.TakeChunk(2), ElementsAre(0));
  frames.Start(0);
  frames.Requeue(0, JobFrames::Attempt::kDaemonKilled);
  EXPECT_EQ(frames.infos()[0].attempts(), 0);
  EXPECT_THAT(frames.TakeChunk(2), ElementsAre(1));
  EXPECT_THAT(frames.TakeChunk(2), ElementsAre(2));
  EXPECT_THAT(frames.TakeChunk(2), ElementsAre(0));
}

TEST(JobFrames, ASingleWorkerTakesLongChunks) {
  JobFrames frames = MakeFrames(20);
  EXPECT_EQ(frames.TakeChunk(1).size(), 16u);
  EXPECT_EQ(frames.TakeChunk(1).size(), 4u);
}

TEST(JobFrames, FramesThatFollowEachOtherAreTakenInOrderCrashedOnesToo) {
  JobFrames frames = MakeFrames(5);
  EXPECT_THAT(frames.TakeAll(), ElementsAre(0, 1, 2, 3, 4));
  EXPECT_THAT(frames.TakeAll(), IsEmpty());
  frames.Finish(0, Result(v1::FRAME_STATE_DONE));
  frames.Start(1);
  for (const size_t crashed_or_after : {1, 2, 3, 4})
    frames.Requeue(crashed_or_after, JobFrames::Attempt::kCounts);
  EXPECT_EQ(frames.infos()[1].attempts(), 1);
  EXPECT_THAT(frames.TakeAll(), ElementsAre(1, 2, 3, 4));
}

TEST(JobFrames, ARefundedAttemptLeavesTheFrameAsNew) {
  JobFrames frames = MakeFrames(1);
  frames.TakeChunk(1);
  frames.Start(0);
  frames.Requeue(0, JobFrames::Attempt::kRefunded);
  EXPECT_EQ(frames.infos()[0].attempts(), 0);
  EXPECT_TRUE(frames.HasWaiting());
}

TEST(JobFrames, CountsByState) {
  JobFrames frames = MakeFrames(6);
  for (int i = 0; i < 5; ++i) frames.Start(i);
  frames.Finish(0, Result(v1::FRAME_STATE_DONE, true));
  frames.Finish(1, Result(v1::FRAME_STATE_DEGRADED));
  frames.Finish(2, Result(v1::FRAME_STATE_FAILED));
  frames.End(3, v1::FRAME_STATE_CANCELLED, "cancelled");
  frames.Advance(4, 0.25);
  const v1::FrameCounts counts = frames.Counts();
  EXPECT_EQ(counts.total(), 6);
  EXPECT_EQ(counts.done(), 1);
  EXPECT_EQ(counts.degraded(), 1);
  EXPECT_EQ(counts.failed(), 1);
  EXPECT_EQ(counts.cancelled(), 1);
  EXPECT_EQ(counts.running(), 1);
  EXPECT_EQ(counts.waiting(), 1);
  EXPECT_EQ(counts.reused(), 1);
  EXPECT_DOUBLE_EQ(frames.FramesComputed(), 2.25);  // a reused one is not computed
  EXPECT_DOUBLE_EQ(frames.FramesLeft(), 1.75);
}

TEST(JobFrames, AReaderSeesEachChangeOnceAndOnlyTheLastState) {
  JobFrames frames = MakeFrames(4);
  EXPECT_THAT(frames.ChangedSince(0, 10).positions, IsEmpty());
  frames.Start(2);
  frames.Start(0);
  frames.Advance(2, 0.5);
  const JobFrames::Changes first = frames.ChangedSince(0, 1);
  EXPECT_THAT(first.positions, ElementsAre(0));
  const JobFrames::Changes second = frames.ChangedSince(first.up_to, 10);
  EXPECT_THAT(second.positions, ElementsAre(2));
  EXPECT_EQ(second.up_to, frames.version());
  EXPECT_THAT(frames.ChangedSince(second.up_to, 10).positions, IsEmpty());
}

}  // namespace
}  // namespace weft
