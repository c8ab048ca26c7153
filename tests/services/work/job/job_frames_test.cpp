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

TEST(JobFrames, ChunksLeaveSeveralForEachWorkerWithinTheLimits) {
  EXPECT_EQ(MakeFrames(100).TakeChunk(2).size(), 12u);  // an eighth
  EXPECT_EQ(MakeFrames(100).TakeChunk(5).size(), 5u);
  EXPECT_EQ(MakeFrames(1000).TakeChunk(2).size(), 16u);
  EXPECT_EQ(MakeFrames(1000).TakeChunk(2, {.least = 1, .most = 40}).size(), 40u);
  EXPECT_EQ(MakeFrames(10).TakeChunk(8, {.least = 3, .most = 5}).size(), 3u);
  EXPECT_EQ(MakeFrames(2).TakeChunk(8, {.least = 3, .most = 5}).size(), 2u);
  EXPECT_EQ(MakeFrames(10).TakeChunk(0).size(), 10u);
}

TEST(JobFrames, AreFoundByName) {
  JobFrames frames = MakeFrames(2);
  EXPECT_EQ(frames.Find("1"), 1u);
  EXPECT_EQ(frames.Find("2"), std::nullopt);
  frames.Append({"2", "3"});
  EXPECT_EQ(frames.Find("3"), 3u);
  EXPECT_EQ(frames.infos()[3].frame(), "3");
  EXPECT_EQ(frames.Counts().waiting(), 4);
}

TEST(JobFrames, WhoBeginsToWatchIsToldOfAllThatAreNotWaiting) {
  std::vector<v1::FrameInfo> infos(3);
  infos[0].set_state(v1::FRAME_STATE_WAITING);
  infos[1].set_state(v1::FRAME_STATE_DONE);
  infos[2].set_state(v1::FRAME_STATE_RUNNING);
  const JobFrames frames(infos);
  EXPECT_THAT(frames.ChangedSince(0, 10).positions, ElementsAre(1, 2));
  EXPECT_TRUE(frames.IsProcessed(1));
  EXPECT_FALSE(frames.IsProcessed(0));
  EXPECT_FALSE(frames.IsProcessed(2));
  EXPECT_FALSE(frames.AllProcessed());
  EXPECT_TRUE(JobFrames({infos[1]}).AllProcessed());
}

TEST(JobFrames, EveryChangeIsTold) {
  JobFrames frames = MakeFrames(1);
  uint64_t seen = 0;
  const auto is_told = [&] {
    const JobFrames::Changes changes = frames.ChangedSince(seen, 10);
    seen = changes.up_to;
    return changes.positions.size() == 1;
  };
  EXPECT_FALSE(is_told());
  frames.Start(0);
  EXPECT_TRUE(is_told());
  frames.Advance(0, 0.5);
  EXPECT_TRUE(is_told());
  frames.Requeue(0, JobFrames::Attempt::kCounts);
  EXPECT_TRUE(is_told());
  frames.End(0, v1::FRAME_STATE_FAILED, "dark");
  EXPECT_TRUE(is_told());
  frames.Bridge(0);
  EXPECT_TRUE(is_told());
  frames.DoAgain(0);
  EXPECT_TRUE(is_told());
  frames.Finish(0, Result(v1::FRAME_STATE_DONE));
  EXPECT_TRUE(is_told());
  frames.SetLatency(0, 2);
  EXPECT_TRUE(is_told());
  EXPECT_FALSE(is_told());
}

TEST(JobFrames, ARunningFrameToldItsShare) {
  JobFrames frames = MakeFrames(1);
  frames.Start(0);
  frames.Advance(0, 1.5);
  EXPECT_EQ(frames.infos()[0].share_done(), 1);
  frames.Advance(0, -1);
  EXPECT_EQ(frames.infos()[0].share_done(), 0);
  frames.Advance(0, 0.5);
  EXPECT_EQ(frames.infos()[0].share_done(), 0.5);
  frames.Requeue(0, JobFrames::Attempt::kCounts);
  EXPECT_EQ(frames.infos()[0].share_done(), 0);
  EXPECT_EQ(frames.FramesLeft(), 1);
  frames.Start(0);
  EXPECT_EQ(frames.infos()[0].attempts(), 2);
  frames.Advance(0, 0.5);
  frames.End(0, v1::FRAME_STATE_FAILED, "dark");
  EXPECT_EQ(frames.infos()[0].share_done(), 0);
  EXPECT_EQ(frames.infos()[0].reason(), "dark");
}

TEST(JobFrames, AResultKeepsNameAttemptsAndLatency) {
  JobFrames frames = MakeFrames(2);
  frames.TakeAll();
  frames.Start(1);
  frames.SetLatency(1, 2.5);
  v1::FrameInfo result = Result(v1::FRAME_STATE_FAILED);
  result.set_frame("another"), result.set_attempts(9), result.set_latency_s(9), result.set_reason("dark");
  result.set_redone_from("align"), result.set_redone_because("its version");
  frames.Finish(1, result);
  const v1::FrameInfo& info = frames.infos()[1];
  EXPECT_EQ(info.frame(), "1");
  EXPECT_EQ(info.attempts(), 1);
  EXPECT_EQ(info.latency_s(), 2.5);
  EXPECT_EQ(info.reason(), "dark");
  EXPECT_EQ(info.share_done(), 1);
  frames.ForgetRedone(1);
  EXPECT_EQ(info.redone_from(), "");
  EXPECT_EQ(info.redone_because(), "");
  frames.Bridge(1);
  EXPECT_EQ(frames.Counts().bridged(), 1);
  // Done again, it is as new, and the only one that is not taken.
  frames.DoAgain(1);
  EXPECT_EQ(info.attempts(), 0);
  EXPECT_EQ(info.latency_s(), 2.5);
  EXPECT_EQ(info.reason(), "");
  EXPECT_EQ(frames.Counts().bridged(), 0);
  EXPECT_THAT(frames.TakeAll(), ElementsAre(1));
}

TEST(JobFrames, WhatEndsOrComesBackIsNotTakenAnyMore) {
  JobFrames frames = MakeFrames(2);
  frames.TakeAll();
  frames.End(0, v1::FRAME_STATE_CANCELLED, "");
  frames.DoAgain(0);
  EXPECT_THAT(frames.TakeAll(), ElementsAre(0));
  frames.Requeue(1, JobFrames::Attempt::kRefunded);
  EXPECT_EQ(frames.infos()[1].attempts(), 0) << "it never ran";
  EXPECT_THAT(frames.TakeAll(), ElementsAre(1));
}

TEST(JobFrames, ATaskThatRunsAlreadyHasItsFrames) {
  JobFrames frames = MakeFrames(3);
  frames.Start(0);
  frames.Requeue(0, JobFrames::Attempt::kDaemonKilled);
  frames.Take(0);
  EXPECT_THAT(frames.TakeAll(), ElementsAre(1, 2));
  frames.Requeue(0, JobFrames::Attempt::kRefunded);
  frames.Requeue(1, JobFrames::Attempt::kRefunded);
  EXPECT_THAT(frames.TakeChunk(8), ElementsAre(0)) << "it is late no more";
}

TEST(JobFrames, OfAGrowingTakeTheNewestAreTakenFewAtATime) {
  JobFrames frames = MakeFrames(20);
  frames.SetLive(1);
  EXPECT_EQ(frames.Backlog(), 20);
  EXPECT_THAT(frames.TakeChunk(2), ElementsAre(19, 18, 17, 16));
  EXPECT_THAT(frames.TakeChunk(8), ElementsAre(15, 14));  // an eighth of 16
  EXPECT_THAT(frames.TakeChunk(100), ElementsAre(13));
  EXPECT_THAT(frames.TakeChunk(0), ElementsAre(12, 11, 10, 9));
  frames.Finish(19, Result(v1::FRAME_STATE_DONE));
  EXPECT_EQ(frames.Backlog(), 19);
  frames.SetLive(3);  // 0, 3, 6 ... 18
  EXPECT_EQ(frames.Backlog(), 7);
  EXPECT_THAT(frames.TakeChunk(1), ElementsAre(6, 3, 0));
  EXPECT_THAT(frames.TakeChunk(1), IsEmpty());
  frames.SetLive(0);
  EXPECT_EQ(frames.Backlog(), 0);
  EXPECT_FALSE(frames.HasWaiting());
  frames.SetLive(std::nullopt);
  EXPECT_EQ(frames.Backlog(), 0);
  EXPECT_TRUE(frames.HasWaiting());
}

}  // namespace
}  // namespace weft
