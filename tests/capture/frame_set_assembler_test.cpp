#include "capture/frame_set_assembler.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory>
#include <random>
#include <set>

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr int64_t kMs = 1'000'000;
constexpr int64_t kPeriod_ns = 10 * kMs;
constexpr int64_t kEpoch_ns = int64_t{1'700'000'000} * 1000 * kMs;

// Cameras a, b and c with a frame every 10 ms; what they deliver arrives 3 ms after its device time.
class Assembler : public ::testing::Test {
 protected:
  explicit Assembler(ClockDomain clocks = ClockDomain::kShared) {
    options_.period_ns = kPeriod_ns;
    options_.tolerance_ns = 2 * kMs;
    options_.max_wait_ns = 100 * kMs;
    options_.clocks = clocks;
    Restart();
  }
  void Restart() {
    ASSERT_TRUE(options_.Validate().ok());
    assembler_ = std::make_unique<FrameSetAssembler>(ids_, options_);
    got_ = {};
  }

  // Frame `id` of a camera; its clock is off by `clock_ns`, it was late by `late_ns`.
  CameraDelivery FrameOf(uint64_t id, int64_t clock_ns = 0, int64_t late_ns = 0) {
    CameraDelivery delivery;
    const int64_t taken_ns = kEpoch_ns + static_cast<int64_t>(id) * kPeriod_ns + late_ns;
    delivery.frame.device_frame_id = id;
    delivery.frame.device_time_ns = taken_ns + clock_ns;
    delivery.frame.host_time_ns = taken_ns + 3 * kMs;
    return delivery;
  }
  void Add(size_t camera, CameraDelivery delivery) {
    delivery.frame.camera_id = ids_[camera];
    now_ns_ = std::max(now_ns_, delivery.frame.host_time_ns);
    Collect(assembler_->Add(camera, std::move(delivery), now_ns_));
  }
  void AddAll(uint64_t id) {
    for (size_t camera = 0; camera < 3; ++camera) Add(camera, FrameOf(id));
  }
  CameraDelivery Say(CameraDelivery::Kind kind, const std::string& cause) {
    CameraDelivery delivery;
    delivery.kind = kind;
    delivery.cause = cause;
    delivery.frame.host_time_ns = now_ns_;
    return delivery;
  }
  void Collect(AssembledSets out) {
    for (RawFrameSet& set : out.sets) got_.sets.push_back(std::move(set));
    for (LedgerEntry& entry : out.entries) got_.entries.push_back(std::move(entry));
  }
  void Finish() { Collect(assembler_->Finish(now_ns_)); }

  std::vector<uint64_t> Numbers() const {
    std::vector<uint64_t> numbers;
    for (const RawFrameSet& set : got_.sets) numbers.push_back(set.number);
    return numbers;
  }
  std::vector<std::string> Causes() const {
    std::vector<std::string> causes;
    for (const LedgerEntry& entry : got_.entries) causes.push_back(entry.cause);
    return causes;
  }
  // Every frame of a set was taken at one trigger, in sets without a missing camera all frames are there.
  void ExpectOneTriggerEach() const {
    for (const RawFrameSet& set : got_.sets) {
      EXPECT_EQ(set.frames.size() + set.missing.size(), 3u);
      for (const RawFrame& frame : set.frames)
        EXPECT_EQ(frame.device_frame_id, set.frames[0].device_frame_id);
    }
  }

  const std::vector<std::string> ids_ = {"a", "b", "c"};
  FrameSetOptions options_;
  std::unique_ptr<FrameSetAssembler> assembler_;
  AssembledSets got_;
  int64_t now_ns_ = 0;
};

class EstimatedClocks : public Assembler {
 protected:
  EstimatedClocks() : Assembler(ClockDomain::kEstimated) {}
};

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
  EXPECT_EQ(got_.sets.size(), 200u);
  EXPECT_TRUE(
      std::all_of(got_.sets.begin(), got_.sets.end(), [](const auto& set) { return set.missing.empty(); }));
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
  EXPECT_EQ(got_.sets[1].missing[0].reason, "its frame is 4.000 ms late, the tolerance is 2.000 ms");
  EXPECT_EQ(got_.sets[2].frames.size(), 1u);  // what the camera took is kept as well
}

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
  EXPECT_EQ(got_.sets.size(), 60'000u);
  EXPECT_TRUE(
      std::all_of(got_.sets.begin(), got_.sets.end(), [](const auto& set) { return set.missing.empty(); }));
  EXPECT_THAT(got_.entries, IsEmpty());
  ExpectOneTriggerEach();
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
