#include "services/work/pipeline/frame_neighbors.h"

#include <gtest/gtest.h>

#include <optional>
#include <set>
#include <tuple>

namespace weft {
namespace {

// A job of these frames, of which those in `failed` failed; all are complete.
Neighbors NeighborsOf(int at, const std::vector<std::string>& names, const std::set<int>& failed = {}) {
  const auto facts = [&](int frame) {
    FrameFacts found{names[frame], "images"};
    found.failed = failed.contains(frame);
    found.registered = !found.failed;
    return found;
  };
  return FindNeighbors(at, static_cast<int>(names.size()), FrameSteps(names), facts(at),
                       [&](int other) -> std::optional<FrameFacts> { return facts(other); });
}

const std::vector<std::string> kGap = {"0000", "0001", "0002", "0010", "0011", "0012"};

TEST(FrameNeighbors, ThoseBeforeAndAfterWhereNumbersGoOn) {
  for (const std::vector<std::string>& names :
       {std::vector<std::string>{"0000", "0001", "0002"}, {"0000", "0003", "0006"}, {"a", "b", "z9"}}) {
    const Neighbors found = NeighborsOf(1, names);
    EXPECT_EQ(found.previous, 0);
    EXPECT_EQ(found.next, 2);
    EXPECT_EQ(found.window, "images " + names[0] + ":images " + names[2] + ":images");
  }
}

TEST(FrameNeighbors, NoneBeyondAGap) {
  EXPECT_EQ(NeighborsOf(2, kGap).previous, 1);
  EXPECT_EQ(NeighborsOf(2, kGap).next, -1);
  EXPECT_EQ(NeighborsOf(2, kGap).window, "images 0001:images");
  EXPECT_EQ(NeighborsOf(3, kGap).previous, -1);
  EXPECT_EQ(NeighborsOf(3, kGap).next, 4);
  EXPECT_EQ(NeighborsOf(4, kGap).previous, 3);
  EXPECT_EQ(NeighborsOf(4, kGap).next, 5);
}

TEST(FrameNeighbors, AFrameBeyondAGapNeedNotBeComplete) {
  const FrameSteps steps(kGap);
  const FrameFacts own{"0002", "images", true};
  const Neighbors found = FindNeighbors(2, 6, steps, own, [](int other) -> std::optional<FrameFacts> {
    if (other == 3) return std::nullopt;
    return FrameFacts{"0001", "images", true};
  });
  EXPECT_TRUE(found.complete);
  EXPECT_EQ(found.previous, 1);
}

TEST(FrameNeighbors, BridgesReachStepsNotFrames) {
  const std::vector<std::string> lost = {"0000", "0001", "0003", "0004", "0005"};  // 0002 was lost
  EXPECT_EQ(NeighborsOf(1, lost, {1}).previous, 0);
  EXPECT_EQ(NeighborsOf(1, lost, {1}).next, 2);
  EXPECT_EQ(NeighborsOf(2, kGap, {2}).previous, 1);
  EXPECT_EQ(NeighborsOf(2, kGap, {2}).next, -1);
  const std::vector<std::string> three = {"0", "1", "2", "3", "4", "5"};
  EXPECT_EQ(NeighborsOf(1, three, {1, 2, 3}).next, 4);
  EXPECT_EQ(NeighborsOf(1, three, {1, 2, 3, 4}).next, -1);
}

TEST(FrameNeighbors, AFrameThatIsNotDealtWithLeavesItOpen) {
  const std::vector<std::string> names = {"0", "1", "2", "3", "4"};
  const auto look = [&](int missing, bool failed) {
    FrameFacts own{"2", "images"};
    own.failed = failed, own.registered = !failed;
    return FindNeighbors(2, 5, FrameSteps(names), own, [&](int other) -> std::optional<FrameFacts> {
      if (other == missing) return std::nullopt;
      FrameFacts found{names[static_cast<size_t>(other)], "images"};
      found.registered = other == 0 || other == 4;
      found.failed = !found.registered;
      return found;
    });
  };
  EXPECT_FALSE(look(1, false).complete);
  EXPECT_FALSE(look(3, false).complete);
  EXPECT_TRUE(look(0, false).complete) << "two steps away";
  EXPECT_EQ(look(0, false).previous, -1) << "the one before it failed";
  EXPECT_FALSE(look(0, true).complete);
  EXPECT_EQ(look(-1, true).previous, 0);
  EXPECT_EQ(look(-1, true).next, 4);
  EXPECT_EQ(look(-1, true).window, "images 1:images 0:images 3:images 4:images");
}

TEST(FactsOf, AreThoseOfTheReport) {
  v1::FrameReport report;
  report.set_frame("f"), report.set_images_fingerprint("images");
  for (const auto& [state, registered, failed] : {std::tuple(v1::FRAME_STATE_DONE, true, false),
                                                  {v1::FRAME_STATE_DEGRADED, true, false},
                                                  {v1::FRAME_STATE_FAILED, false, true},
                                                  {v1::FRAME_STATE_CANCELLED, false, false}}) {
    report.set_state(state);
    EXPECT_EQ(FactsOf(report).registered, registered) << state;
    EXPECT_EQ(FactsOf(report).failed, failed) << state;
  }
  EXPECT_EQ(FactsOf(report).frame, "f");
  EXPECT_EQ(FactsOf(report).images_fingerprint, "images");
  EXPECT_FALSE(FactsOf(report).frames_alone);
  report.mutable_options()->set_frames_alone(true);
  EXPECT_TRUE(FactsOf(report).frames_alone);
}

}  // namespace
}  // namespace weft
