#include "capture/sync/frame_set_assembler.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <random>
#include <set>

#include "tests/capture/sync/assembler_fixture.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST_F(Assembler, DeliversSetsAsSoonAsTheyAreComplete) {
  for (uint64_t id = 0; id < 5; ++id) AddAll(id);
  EXPECT_THAT(Numbers(), ElementsAre(0, 1, 2, 3, 4));
  EXPECT_THAT(got_.entries, IsEmpty());
  ExpectOneTriggerEach();
}

TEST_F(Assembler, PutsTogetherWhatArrivesInAnyOrderBetweenTheCameras) {
  // Camera b runs ahead of the others by up to 8 frames on its way here.
  std::mt19937 random(3);
  std::array<uint64_t, 3> next = {0, 0, 0};
  while (*std::min_element(next.begin(), next.end()) < 200) {
    const size_t camera = random() % 3;
    const uint64_t slowest = *std::min_element(next.begin(), next.end());
    if (next[camera] >= 200 || next[camera] > slowest + 8) continue;
    const auto jitter_ns = static_cast<int64_t>(random() % kMs) - kMs / 2;
    Add(camera, FrameOf(next[camera]++, jitter_ns));
  }
  ExpectAllComplete(200);
  ExpectOneTriggerEach();
}

TEST_F(Assembler, NamesTheLostPacketsOfAMissingFrame) {
  AddAll(0);
  Add(0, FrameOf(1));
  CameraDelivery lost = FrameOf(1);
  lost.kind = CameraDelivery::Kind::kLostFrame;
  lost.cause = "3 of 80 packets lost";
  Add(1, lost);
  Add(2, FrameOf(1));
  ASSERT_EQ(got_.sets.size(), 2u);
  ASSERT_EQ(got_.sets[1].missing.size(), 1u);
  EXPECT_EQ(got_.sets[1].missing[0].camera_id, "b");
  EXPECT_EQ(got_.sets[1].missing[0].reason, "3 of 80 packets lost");
  ExpectOneTriggerEach();
}

TEST_F(Assembler, SeesInTheCamerasOwnCountWhatNeverArrived) {
  AddAll(0);
  for (size_t camera : {0, 2}) Add(camera, FrameOf(1));
  AddAll(2);
  ASSERT_EQ(got_.sets.size(), 3u);
  EXPECT_EQ(got_.sets[1].missing[0].reason, "the camera counted its frame 1, and nothing of it arrived");
  EXPECT_TRUE(got_.sets[2].missing.empty());
}

TEST_F(Assembler, DropsIncompleteSetsWithTheirCausesWhereAsked) {
  options_.drop_incomplete = true;
  Restart();
  AddAll(0);
  for (size_t camera : {0, 2}) Add(camera, FrameOf(1));
  AddAll(2);
  EXPECT_THAT(Numbers(), ElementsAre(0, 2));
  ASSERT_EQ(got_.entries.size(), 1u);
  EXPECT_EQ(got_.entries[0].event, LedgerEvent::kDropped);
  EXPECT_EQ(got_.entries[0].first_set, 1u);
  EXPECT_THAT(got_.entries[0].cause, HasSubstr("incomplete: b: the camera counted its frame 1"));
}

TEST_F(Assembler, TakesTheNextFrameForNoLateOne) {
  AddAll(0);
  for (size_t camera : {0, 2}) Add(camera, FrameOf(1));
  CameraDelivery next = FrameOf(2);
  next.frame.device_frame_id = 1;  // the camera did not count the trigger that it missed
  Add(1, next);
  ASSERT_EQ(got_.sets.size(), 2u);
  EXPECT_EQ(got_.sets[1].missing[0].reason, "the camera took no frame at this trigger");
}

TEST_F(Assembler, AccountsForTriggersOfWhichNoCameraTells) {
  AddAll(0);
  for (uint64_t id = 4; id < 6; ++id) AddAll(id);
  EXPECT_THAT(Numbers(), ElementsAre(0, 4, 5));
  ASSERT_EQ(got_.entries.size(), 1u);
  EXPECT_EQ(got_.entries[0].event, LedgerEvent::kDropped);
  EXPECT_EQ(got_.entries[0].first_set, 1u);
  EXPECT_EQ(got_.entries[0].last_set, 3u);
  EXPECT_EQ(got_.entries[0].cause, "no camera delivered a frame");
}

TEST_F(Assembler, DoesNotWaitForACameraThatIsGone) {
  AddAll(0);
  Add(1, Say(CameraDelivery::Kind::kDisconnected, "no heartbeat"));
  for (uint64_t id = 1; id < 4; ++id)
    for (size_t camera : {0, 2}) Add(camera, FrameOf(id));
  EXPECT_EQ(got_.sets.size(), 4u);
  EXPECT_EQ(got_.sets[3].missing[0].reason, "the camera is disconnected");
  Add(1, Say(CameraDelivery::Kind::kReconnected, "after 30 ms"));
  // It counts from zero again.
  for (uint64_t id = 4; id < 6; ++id) {
    for (size_t camera : {0, 2}) Add(camera, FrameOf(id));
    CameraDelivery again = FrameOf(id);
    again.frame.device_frame_id = id - 4;
    Add(1, again);
  }
  EXPECT_EQ(got_.sets.size(), 6u);
  EXPECT_TRUE(got_.sets[5].missing.empty());
  EXPECT_THAT(Causes(), ElementsAre("disconnected: no heartbeat", "reconnected: after 30 ms"));
}

TEST_F(Assembler, WaitsForASilentCameraNoLongerThanItMay) {
  for (size_t camera : {0, 2}) Add(camera, FrameOf(0));
  Collect(assembler_->Advance(now_ns_ + 99 * kMs));
  EXPECT_THAT(got_.sets, IsEmpty());
  now_ns_ += 101 * kMs;
  Collect(assembler_->Advance(now_ns_));
  ASSERT_EQ(got_.sets.size(), 1u);
  EXPECT_EQ(got_.sets[0].missing[0].reason, "the camera has not delivered yet");
  Add(1, FrameOf(0));
  EXPECT_THAT(Causes(), ElementsAre(HasSubstr("frame 0 came 0.000 ms after its set was closed")));
}

TEST_F(Assembler, KeepsTheOthersTogetherWhenOneIsOutsideTheTolerance) {
  AddAll(0);
  Add(0, FrameOf(1));
  Add(2, FrameOf(1));
  Add(1, FrameOf(1, 0, 4 * kMs));
  AddAll(2);
  Finish();
  ASSERT_EQ(got_.sets.size(), 4u);
  EXPECT_EQ(got_.sets[1].frames.size(), 2u);
  EXPECT_EQ(got_.sets[1].missing[0].reason, "4.0 ms late (tolerance 2 ms)");
  EXPECT_EQ(got_.sets[2].frames.size(), 1u);  // what the camera took is kept as well
}

TEST_F(Assembler, BeginsWhenEveryCameraDelivers) {
  options_.start_wait_ns = 1000 * kMs;
  Restart();
  for (uint64_t id = 0; id < 20; ++id) {
    Add(0, FrameOf(id));
    if (id >= 4) Add(1, FrameOf(id));
    if (id >= 15) Add(2, FrameOf(id));
  }
  EXPECT_THAT(Numbers(), ElementsAre(0, 1, 2, 3, 4));
  for (const RawFrameSet& set : got_.sets) EXPECT_TRUE(set.missing.empty());
  EXPECT_THAT(Causes(),
              ElementsAre("recording began once all cameras delivered; 15 earlier triggers left out"));
}

TEST_F(Assembler, BeginsAfterTheTriggersThatItLeftOutWhileCamerasHadABacklog) {
  options_.start_wait_ns = 1000 * kMs;
  Restart();
  for (uint64_t id = 0; id < 20; ++id) Add(0, FrameOf(id));
  for (uint64_t id = 0; id < 20; ++id) Add(1, FrameOf(id));
  for (uint64_t id = 3; id < 20; ++id) Add(2, FrameOf(id));
  EXPECT_THAT(Numbers(), ElementsAre(0, 1, 2, 3, 4, 5, 6, 7));
  for (const RawFrameSet& set : got_.sets) EXPECT_TRUE(set.missing.empty());
}

TEST_F(Assembler, BeginsWithoutACameraThatStaysSilent) {
  options_.start_wait_ns = 100 * kMs;
  Restart();
  for (uint64_t id = 0; id < 30; ++id)
    for (size_t camera : {0, 2}) Add(camera, FrameOf(id));
  Finish();
  ASSERT_FALSE(got_.sets.empty());
  EXPECT_EQ(got_.sets[0].missing[0].reason, "the camera has not delivered yet");
}

TEST_F(Assembler, CutsOffWhatIsUnderWayAtTheEnd) {
  AddAll(0);
  for (size_t camera : {0, 2}) Add(camera, FrameOf(1));
  EXPECT_TRUE(assembler_->IsWaiting(now_ns_ + 1));
  EXPECT_FALSE(assembler_->IsWaiting(now_ns_));
  Collect(assembler_->Finish(now_ns_, now_ns_));
  EXPECT_THAT(Numbers(), ElementsAre(0));
  EXPECT_THAT(Causes(),
              ElementsAre("the take ended while 1 frame sets waited for a camera: they are not in it"));
}

TEST_F(Assembler, CountsTheTriggersWhileAllCamerasAreAway) {
  for (uint64_t id = 0; id < 3; ++id) AddAll(id);
  const int64_t last_host_ns = now_ns_;
  for (size_t camera : {0, 1, 2}) Add(camera, Say(CameraDelivery::Kind::kDisconnected, "no heartbeat"));
  for (int ms = 0; ms < 3000; ms += 50) Collect(assembler_->Advance(last_host_ns + ms * kMs));
  uint64_t dropped = 0;
  for (const LedgerEntry& entry : got_.entries) {
    if (entry.event != LedgerEvent::kDropped) continue;
    EXPECT_EQ(entry.first_set, 3 + dropped);
    EXPECT_EQ(entry.cause, "no camera delivered a frame: all are disconnected");
    dropped = entry.last_set - 2;
  }
  EXPECT_GT(dropped, 190u);
  EXPECT_LT(dropped, 300u);
  // One that comes back is in the set of its own trigger.
  now_ns_ = last_host_ns + 3000 * kMs;
  Add(1, Say(CameraDelivery::Kind::kReconnected, "after 3 s"));
  Add(1, FrameOf(310));
  ASSERT_EQ(Numbers().back(), 310u);
  EXPECT_EQ(got_.sets.back().missing[0].reason, "the camera is disconnected");
}

TEST_F(Assembler, CountsUpToTheEndOfTheRecording) {
  for (const bool away : {true, false}) {
    Restart();
    for (uint64_t id = 0; id < 3; ++id) AddAll(id);
    const int64_t end_ns = now_ns_ + 1004 * kMs;
    if (away)
      for (size_t camera : {0, 1, 2}) Add(camera, Say(CameraDelivery::Kind::kSilent, ""));
    Collect(assembler_->Finish(end_ns + 70 * kMs, end_ns));
    ASSERT_EQ(got_.entries.size(), 1u);
    EXPECT_EQ(got_.entries[0].first_set, 3u);
    EXPECT_EQ(got_.entries[0].last_set, 102u);
    EXPECT_THAT(got_.entries[0].cause, HasSubstr("no camera delivered a frame"));
    now_ns_ = end_ns;
  }
}

TEST_F(Assembler, SaysOfACameraThatDoesNotAnswerThatItIsDisconnected) {
  AddAll(0);
  Add(1, Say(CameraDelivery::Kind::kSilent, ""));
  for (size_t camera : {0, 2}) Add(camera, FrameOf(1));
  now_ns_ += 101 * kMs;
  Collect(assembler_->Advance(now_ns_));
  ASSERT_EQ(got_.sets.size(), 2u);
  EXPECT_EQ(got_.sets[1].missing[0].reason, "the camera does not answer: disconnected or without power");
}

TEST_F(Assembler, OpensNoGapLongerThanTheHostsClockWentOn) {
  for (uint64_t id = 0; id < 3; ++id) AddAll(id);
  // All clocks jump by an hour at once, their counts begin anew.
  for (size_t camera = 0; camera < 3; ++camera) {
    CameraDelivery delivery = FrameOf(3, 3'600'000 * kMs);
    delivery.frame.device_frame_id = 0;
    Add(camera, delivery);
  }
  ASSERT_EQ(got_.sets.size(), 4u);
  EXPECT_LT(got_.sets[3].number, 20u);
}

TEST_F(Assembler, AccountsForEveryTriggerUnderRandomTrouble) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    Restart();
    std::mt19937 random(seed);
    std::array<int64_t, 3> clock_ns = {0, 0, 0};
    for (uint64_t id = 0; id < 300; ++id) {
      for (size_t camera = 0; camera < 3; ++camera) {
        const unsigned what = random() % 100;
        if (what < 3) continue;
        // A clock that is off from the very start is no jump.
        if (what == 4 && id > 9)
          clock_ns[camera] += static_cast<int64_t>(random() % 20'000) * kMs - 10'000 * kMs;
        CameraDelivery delivery = FrameOf(id, clock_ns[camera]);
        if (what < 8 && what > 4) {
          delivery.kind = CameraDelivery::Kind::kLostFrame;
          delivery.cause = "packets lost";
        }
        Add(camera, delivery);
      }
    }
    Finish();
    std::set<uint64_t> accounted;
    for (const RawFrameSet& set : got_.sets) {
      EXPECT_TRUE(accounted.insert(set.number).second);
      for (const MissingFrame& missing : set.missing) EXPECT_NE(missing.reason, "");
    }
    for (const LedgerEntry& entry : got_.entries) {
      if (entry.event != LedgerEvent::kDropped) continue;
      for (uint64_t set = entry.first_set; set <= entry.last_set; ++set) {
        EXPECT_TRUE(accounted.insert(set).second);
      }
    }
    EXPECT_EQ(accounted.size(), *accounted.rbegin() + 1);
    EXPECT_GE(accounted.size(), 299u);
    EXPECT_LE(accounted.size(), 300u);
    ExpectOneTriggerEach();
  }
}

TEST(FrameSetOptions, RefusesAToleranceThatFitsTwoSets) {
  FrameSetOptions options;
  options.period_ns = 3 * kMs;
  options.tolerance_ns = 2 * kMs;
  EXPECT_THAT(std::string(options.Validate().message()), HasSubstr("below half the period"));
}

}  // namespace
}  // namespace weft
