// Three cameras and what a FrameSetAssembler makes of their frames.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "capture/sync/frame_set_assembler.h"

namespace weft {

inline constexpr int64_t kMs = 1'000'000;
inline constexpr int64_t kPeriod_ns = 10 * kMs;
inline constexpr int64_t kEpoch_ns = int64_t{1'700'000'000} * 1000 * kMs;

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
  void Finish() {
    now_ns_ += options_.max_wait_ns;
    Collect(assembler_->Advance(now_ns_));
    Collect(assembler_->Finish(now_ns_, now_ns_));
  }

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
  void ExpectAllComplete(size_t sets) const {
    EXPECT_EQ(got_.sets.size(), sets);
    EXPECT_TRUE(
        std::all_of(got_.sets.begin(), got_.sets.end(), [](const auto& set) { return set.missing.empty(); }));
  }
  // Every frame of a set was taken at one trigger.
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

}  // namespace weft
