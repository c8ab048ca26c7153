#include "capture/sync/unsynchronized_frames.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <vector>

#include "tests/capture/sync/assembler_fixture.h"

namespace weft {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Sets by a and b; c films at the same rate at another phase, by CLOCK_MONOTONIC.
class MixedPaces : public Assembler {
 protected:
  static constexpr int64_t kMonotonic_ns = -1'600'000'000'000'000'000;  // minus the host's clock

  MixedPaces() {
    options_.cameras = {{}, {}, {.own_clock = true, .unsynchronized = true}};
    Begin();
  }
  void Begin() {
    Restart();
    CameraDelivery reading;
    reading.kind = CameraDelivery::Kind::kClock;
    reading.clock = {kEpoch_ns, kMonotonic_ns, 1000, "", {}};
    Collect(assembler_->Add(2, reading, kEpoch_ns));
    reading.clock = {kEpoch_ns, 0, 1000, "Slave", 0};
    Collect(assembler_->Add(0, reading, kEpoch_ns));
  }
  void AddTriggered(uint64_t id) {
    Add(0, FrameOf(id));
    Add(1, FrameOf(id));
  }
  void AddUnsynchronized(uint64_t id, int64_t phase_ns) { Add(2, FrameOf(id, kMonotonic_ns, phase_ns)); }
  // The frame of c in each set; 0 where it has none.
  std::vector<uint64_t> UnsynchronizedIds() const {
    std::vector<uint64_t> ids;
    for (const RawFrameSet& set : got_.sets)
      ids.push_back(set.frames.size() == 3 ? set.frames[2].device_frame_id : 0);
    return ids;
  }
};

TEST_F(MixedPaces, AtAnyPhaseEverySetHasOneFrame) {
  for (const int64_t phase_ns : {-4 * kMs, -kMs, 0 * kMs, 3 * kMs, 4 * kMs}) {
    Begin();
    for (uint64_t id = 1; id <= 20; ++id) {
      if (phase_ns < 0) AddUnsynchronized(id, phase_ns);
      AddTriggered(id);
      if (phase_ns >= 0) AddUnsynchronized(id, phase_ns);
    }
    Finish();
    ASSERT_EQ(got_.sets.size(), 20u) << phase_ns;
    for (size_t i = 0; i < 20; ++i) EXPECT_EQ(UnsynchronizedIds()[i], i + 1) << phase_ns;
  }
}

TEST_F(MixedPaces, SlowerCameraLacksOneFrameAndFasterOneHasOneTooManyForEachPeriodOfDrift) {
  for (const int64_t drift_ns : {kMs / 10, -kMs / 10}) {
    UnsynchronizedFrames frames(kPeriod_ns);
    int missing = 0;
    std::vector<uint64_t> ids;
    uint64_t next = 0;
    for (int64_t trigger = 0; trigger < 300; ++trigger) {
      while (!frames.Knows(trigger * kPeriod_ns)) {
        RawFrame frame;
        frame.device_frame_id = ++next;
        const auto index = static_cast<int64_t>(next) - 1;
        frames.Add(frame, index * kPeriod_ns + index * drift_ns);
      }
      const auto frame = frames.Take(trigger * kPeriod_ns);
      missing += frame ? 0 : 1;
      if (frame) ids.push_back(frame->device_frame_id);
    }
    // 300 triggers: 30 ms of drift are 3 periods.
    EXPECT_NEAR(missing, drift_ns > 0 ? 3 : 0, 1);
    EXPECT_EQ(std::adjacent_find(ids.begin(), ids.end(), std::greater_equal<>()), ids.end());  // none twice
    EXPECT_NEAR(static_cast<double>(ids.back()), drift_ns > 0 ? 297 : 303, 1.5);
    EXPECT_THAT(frames.TakeLeftOver(),
                drift_ns > 0 ? HasSubstr("") : HasSubstr("(3) are nearest to no trigger"));
  }
}

TEST_F(MixedPaces, LossHasTheCauseThatTheCameraGave) {
  for (uint64_t id = 1; id <= 6; ++id) {
    AddTriggered(id);
    if (id == 4) {
      CameraDelivery lost = FrameOf(id, kMonotonic_ns, 4 * kMs);
      lost.kind = CameraDelivery::Kind::kLostFrame;
      lost.cause = "torn: the driver marks the image as damaged";
      Add(2, lost);
    } else {
      AddUnsynchronized(id, 4 * kMs);
    }
  }
  Finish();
  EXPECT_EQ(UnsynchronizedIds(), (std::vector<uint64_t>{1, 2, 3, 0, 5, 6}));
  EXPECT_EQ(got_.sets[3].missing[0].reason, "torn: the driver marks the image as damaged");
  EXPECT_THAT(Causes(), IsEmpty());
}

TEST_F(MixedPaces, UnsteadyCameraHasOneFrameInEverySet) {
  const std::vector<int64_t> late_ns = {0, 6 * kMs, 2 * kMs, 6 * kMs, 7 * kMs, 0, 5 * kMs, 1 * kMs};
  for (uint64_t id = 1; id <= 8; ++id) {
    AddTriggered(id);
    AddUnsynchronized(id, late_ns[id - 1]);
  }
  Finish();
  EXPECT_EQ(UnsynchronizedIds(), (std::vector<uint64_t>{1, 2, 3, 4, 5, 6, 7, 8}));
}

TEST_F(MixedPaces, FindsItsPaceAgainWhenTheCameraLeftOutTriggersWithoutCounting) {
  for (uint64_t id = 1; id <= 20; ++id) {
    AddTriggered(id);
    if (id >= 6 && id < 12) continue;
    CameraDelivery frame = FrameOf(id, kMonotonic_ns, kMs);
    if (id >= 12) frame.frame.device_frame_id = id - 6;
    Add(2, frame);
  }
  Finish();
  EXPECT_EQ(UnsynchronizedIds().back(), 14u);
  EXPECT_EQ(UnsynchronizedIds()[12], 7u);
}

TEST_F(MixedPaces, FramesWithoutTriggersAreNoted) {
  for (uint64_t id = 1; id <= 12; ++id) {
    if (id < 4 || id > 8) AddTriggered(id);
    AddUnsynchronized(id, kMs);
  }
  Finish();
  EXPECT_THAT(Causes(),
              ::testing::Contains("its frames 4 to 8 (5) are nearest to no trigger and in no frame set"));
}

TEST_F(MixedPaces, NeedsARate) {
  options_.period_ns = 0;
  EXPECT_THAT(std::string(options_.Validate().message()), HasSubstr("needs the rate"));
}

}  // namespace
}  // namespace weft
