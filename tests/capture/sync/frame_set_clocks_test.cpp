#include "capture/sync/frame_set_assembler.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <random>

#include "tests/capture/sync/assembler_fixture.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST_F(Assembler, FollowsAClockThatJumps) {
  for (const int64_t jump_ns : {int64_t{3'200} * kMs, -int64_t{3'200} * kMs, -kEpoch_ns}) {
    Restart();
    for (uint64_t id = 0; id < 3; ++id) AddAll(id);
    for (uint64_t id = 3; id < 6; ++id) {
      for (size_t camera : {0, 2}) Add(camera, FrameOf(id));
      Add(1, FrameOf(id, jump_ns));
    }
    EXPECT_EQ(got_.sets.size(), 6u);
    for (const RawFrameSet& set : got_.sets) EXPECT_TRUE(set.missing.empty());
    ASSERT_EQ(got_.entries.size(), 1u);
    EXPECT_EQ(got_.entries[0].camera_id, "b");
    EXPECT_THAT(got_.entries[0].cause, HasSubstr("its clock jumped by"));
    ExpectOneTriggerEach();
  }
}

TEST_F(EstimatedClocks, MatchesByWhenFramesArriveAndFollowsDrift) {
  // Ten minutes; b counts from its own start and is fast by 50 ppm, c is slow by 30 ppm.
  for (uint64_t id = 0; id < 60'000; ++id) {
    const auto elapsed_ns = static_cast<int64_t>(id) * kPeriod_ns;
    Add(0, FrameOf(id));
    Add(1, FrameOf(id, -kEpoch_ns + elapsed_ns / 20'000));
    Add(2, FrameOf(id, 77 * kMs - elapsed_ns / 33'333));
  }
  ExpectAllComplete(60'000);
  EXPECT_THAT(got_.entries, IsEmpty());
  ExpectOneTriggerEach();
}

TEST_F(EstimatedClocks, TakeArrivalsThatScatterForNoJumps) {
  // Arrivals are late by up to 400 ms, in rushes, as on a machine that has other things to do; a clock that
  // does jump is still noticed.
  options_.max_wait_ns = 2000 * kMs;
  Restart();
  std::mt19937 random(5);
  std::array<int64_t, 3> busy_until_ns = {0, 0, 0};
  for (uint64_t id = 0; id < 6000; ++id) {
    for (size_t camera = 0; camera < 3; ++camera) {
      const int64_t jump_ns = camera == 1 && id >= 3000 ? 700 * kMs : 0;
      CameraDelivery delivery = FrameOf(id, 123 * kMs * static_cast<int64_t>(camera) + jump_ns);
      int64_t& busy_ns = busy_until_ns[camera];
      if (id > 5 && random() % 60 == 0)
        busy_ns = delivery.frame.host_time_ns + static_cast<int64_t>(random() % 400) * kMs;
      delivery.frame.host_time_ns = std::max(delivery.frame.host_time_ns, busy_ns);
      Add(camera, std::move(delivery));
    }
  }
  ExpectAllComplete(6000);
  ExpectOneTriggerEach();
  ASSERT_EQ(got_.entries.size(), 1u);
  EXPECT_EQ(got_.entries[0].camera_id, "b");
  EXPECT_THAT(got_.entries[0].cause, HasSubstr("its clock jumped by 0.700 s"));
}

TEST_F(EstimatedClocks, ArePutTogetherByReadingsWhereArrivalsMislead) {
  // Camera c takes 8 ms longer than the others to send a frame, more than the tolerance.
  for (size_t camera = 0; camera < 3; ++camera) {
    CameraDelivery reading = Say(CameraDelivery::Kind::kClock, "");
    reading.clock.host_time_ns = kEpoch_ns;
    reading.clock.device_minus_host_ns = static_cast<int64_t>(camera) * 55 * kMs;
    reading.clock.uncertainty_ns = kMs / 10;
    Add(camera, reading);
  }
  for (uint64_t id = 0; id < 50; ++id) {
    for (size_t camera = 0; camera < 3; ++camera) {
      CameraDelivery delivery = FrameOf(id, static_cast<int64_t>(camera) * 55 * kMs);
      if (camera == 2) delivery.frame.host_time_ns += 8 * kMs;
      Add(camera, std::move(delivery));
    }
  }
  ExpectAllComplete(50);
}

TEST_F(EstimatedClocks, LeaveOutFramesUntilAReadingTellsTheirTrigger) {
  // The first reading of b took so long that its frames look as if they were of the trigger before.
  options_.start_wait_ns = 1000 * kMs;
  Restart();
  for (uint64_t id = 0; id < 20; ++id) {
    for (size_t camera = 0; camera < 3; ++camera) {
      if (id % 5 == 0) {
        const bool vague = camera == 1 && id == 0;
        CameraDelivery reading = Say(CameraDelivery::Kind::kClock, "");
        reading.clock.host_time_ns = kEpoch_ns + static_cast<int64_t>(id) * kPeriod_ns;
        reading.clock.device_minus_host_ns = vague ? 9 * kMs : 0;
        reading.clock.uncertainty_ns = vague ? 10 * kMs : kMs / 10;
        Add(camera, reading);
      }
      Add(camera, FrameOf(id));
    }
  }
  ExpectAllComplete(15);
  ExpectOneTriggerEach();
  EXPECT_THAT(Causes(),
              ElementsAre("recording began once all cameras delivered; 5 earlier triggers left out"));
}

TEST_F(EstimatedClocks, SayWhyACameraThatCameBackIsStillMissing) {
  options_.start_wait_ns = 1000 * kMs;
  Restart();
  const auto read = [&](size_t camera, int64_t error_ns, int64_t uncertainty_ns) {
    CameraDelivery reading = Say(CameraDelivery::Kind::kClock, "");
    reading.clock = {kEpoch_ns, error_ns, uncertainty_ns, "", {}};
    Add(camera, reading);
  };
  for (size_t camera = 0; camera < 3; ++camera) read(camera, 0, kMs / 10);
  AddAll(0);
  Add(1, Say(CameraDelivery::Kind::kDisconnected, "no heartbeat"));
  Add(1, Say(CameraDelivery::Kind::kReconnected, "after 30 ms"));
  read(1, 9 * kMs, 10 * kMs);
  AddAll(1);
  read(1, 0, kMs / 10);
  AddAll(2);
  ASSERT_EQ(got_.sets.size(), 3u);
  ExpectOneTriggerEach();
  ASSERT_EQ(got_.sets[1].missing.size(), 1u);
  EXPECT_EQ(got_.sets[1].missing[0].reason,
            "the camera's clock was not yet known to within half the tolerance of 2.000 ms");
  EXPECT_TRUE(got_.sets[2].missing.empty());
}

// Frames every 10 ms, readings of camera b every 50 ms that say 0, or an hour too little from frame 100 on.
class Readings : public ::testing::TestWithParam<ClockDomain> {};

class AssemblerOf : public Assembler {
 public:
  explicit AssemblerOf(ClockDomain clocks) : Assembler(clocks) {}
  void TestBody() override {}
  void Run(bool says_zero) {
    options_.tolerance_ns = 4 * kMs;  // frames arrive after 3 ms
    Restart();
    for (uint64_t id = 0; id < 300; ++id) {
      if (id % 5 == 0) {
        CameraDelivery reading = Say(CameraDelivery::Kind::kClock, "");
        const int64_t host_ns = kEpoch_ns + static_cast<int64_t>(id) * kPeriod_ns;
        reading.clock = {host_ns, says_zero ? -host_ns : id < 100 ? 0 : -3'600'000 * kMs, kMs / 10, "", {}};
        Add(1, reading);
      }
      AddAll(id);
    }
    ExpectAllComplete(300);
    EXPECT_EQ(Numbers().back(), 299u);
    EXPECT_THAT(Causes(), ElementsAre(HasSubstr("its clock cannot be read: readings are")));
    EXPECT_FALSE(assembler_->IsClockReadable(1));
    EXPECT_TRUE(assembler_->IsClockReadable(0));
  }
};

TEST_P(Readings, MoveNoFramesThatContradictThem) {
  for (const bool says_zero : {true, false}) AssemblerOf(GetParam()).Run(says_zero);
}

INSTANTIATE_TEST_SUITE_P(Clocks, Readings, ::testing::Values(ClockDomain::kShared, ClockDomain::kEstimated));

TEST_F(Assembler, SeesAJumpInAReadingWhereTriggersComeIrregularly) {
  options_.period_ns = 0;
  Restart();
  AddAll(0);
  CameraDelivery reading = Say(CameraDelivery::Kind::kClock, "");
  reading.clock = {now_ns_, 0, kMs / 10, "Slave", 40};
  Add(1, reading);
  reading.clock.host_time_ns += kMs;
  reading.clock.device_minus_host_ns = -5000 * kMs;
  Add(1, reading);
  for (size_t camera : {0, 2}) Add(camera, FrameOf(1));
  Add(1, FrameOf(1, -5000 * kMs));
  ASSERT_EQ(got_.sets.size(), 2u);
  EXPECT_TRUE(got_.sets[1].missing.empty());
  EXPECT_THAT(Causes(), ElementsAre(HasSubstr("its clock jumped by -5.000 s")));
}

TEST_F(Assembler, FollowsAJumpByTheCountOfFramesWhereAReadingIsVague) {
  CameraDelivery reading = Say(CameraDelivery::Kind::kClock, "");
  for (uint64_t id = 0; id < 6; ++id) {
    const int64_t jump_ns = id < 3 ? 0 : 3200 * kMs;
    if (id == 0 || id == 3) {  // 4 ms wrong, twice the tolerance
      reading.clock = {kEpoch_ns + static_cast<int64_t>(id) * kPeriod_ns,
                       jump_ns + (id == 3 ? 4 * kMs : 0),
                       5 * kMs,
                       "",
                       {}};
      Add(1, reading);
    }
    for (size_t camera : {0, 2}) Add(camera, FrameOf(id));
    Add(1, FrameOf(id, jump_ns));
  }
  ExpectAllComplete(6);
  EXPECT_THAT(Causes(), ElementsAre(HasSubstr("its clock jumped by 3.200 s")));
}

TEST_F(Assembler, TakesBackACameraWhoseClockIsWrong) {
  AddAll(0);
  CameraDelivery reading = Say(CameraDelivery::Kind::kClock, "");
  reading.clock = {now_ns_, 0, kMs / 10, "Slave", 40};
  Add(0, reading);
  Add(1, Say(CameraDelivery::Kind::kDisconnected, "no heartbeat"));
  Add(1, Say(CameraDelivery::Kind::kReconnected, "after 30 ms"));
  reading.clock.device_minus_host_ns = 3200 * kMs;
  Add(1, reading);
  for (size_t camera : {0, 2}) Add(camera, FrameOf(1));
  Add(1, FrameOf(1, 3200 * kMs));
  ASSERT_EQ(got_.sets.size(), 2u);
  EXPECT_TRUE(got_.sets[1].missing.empty());
}

}  // namespace
}  // namespace weft
