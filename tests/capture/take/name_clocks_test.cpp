#include "capture/take/name_clocks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "absl/strings/str_format.h"
#include "capture/take/frame_number.h"

namespace weft {
namespace {

constexpr int64_t kMsInNs = 1'000'000, kOneSecond = 1'000 * kMsInNs, kMinute = 60 * kOneSecond,
                  kHour = 60 * kMinute;

using ::testing::ElementsAre;

std::vector<int64_t> Clocks(const std::vector<std::string>& names) {
  const auto clocks = ClocksInNames(names);
  return clocks ? clocks->times_ns : std::vector<int64_t>();
}

TEST(NameClocks, AreReadOverTheEndOfAMinuteAndAnHour) {
  EXPECT_THAT(Clocks({"101559966", "101600000", "101600033"}),
              ElementsAre(10 * kHour + 16 * kMinute - 34 * kMsInNs, 10 * kHour + 16 * kMinute,
                          10 * kHour + 16 * kMinute + 33 * kMsInNs));
  EXPECT_THAT(Clocks({"img_105959960.l", "img_110000000.l"}),
              ElementsAre(11 * kHour - 40 * kMsInNs, 11 * kHour));
  EXPECT_THAT(Clocks({"101558", "101559", "101600"}),
              ElementsAre(10 * kHour + 15 * kMinute + 58 * kOneSecond,
                          10 * kHour + 15 * kMinute + 59 * kOneSecond, 10 * kHour + 16 * kMinute));
  EXPECT_THAT(Clocks({"000059983333", "000100000000", "000100016667"}),
              ElementsAre(kMinute - 16'667'000, kMinute, kMinute + 16'667'000));
  // A number of the clock's digits, and a stopwatch.
  EXPECT_THAT(Clocks({"95959960", "100000000"}), ElementsAre(10 * kHour - 40 * kMsInNs, 10 * kHour));
  EXPECT_THAT(Clocks({"59960", "100000"}), ElementsAre(kMinute - 40 * kMsInNs, kMinute));
}

TEST(NameClocks, HaveADayOrMarks) {
  constexpr int64_t kDay_ns = 1'623'801'600 * kOneSecond;  // 2021-06-16, `date -u -d 2021-06-16 +%s`
  const int64_t first = kDay_ns + 10 * kHour + 15 * kMinute + kOneSecond + 980 * kMsInNs,
                second = first + 40 * kMsInNs;
  for (const auto& [a, b] : {std::pair("2021-06-16_10-15-01.980", "2021-06-16_10-15-02.020"),
                             {"20210616101501980", "20210616101502020"},
                             {"c3_20210616_101501980", "c3_20210616_101502020"},
                             {"2021-06-16T10:15:01.980Z", "2021-06-16T10:15:02.020Z"}}) {
    const auto clocks = ClocksInNames({a, b});
    ASSERT_TRUE(clocks) << a;
    EXPECT_TRUE(clocks->has_day) << a;
    EXPECT_THAT(clocks->times_ns, ElementsAre(first, second)) << a;
    EXPECT_EQ(clocks->unit_ns, kMsInNs);
  }
  EXPECT_THAT(Clocks({"cam01_10_15_01_980", "cam01_10_15_02_020"}),
              ElementsAre(first - kDay_ns, second - kDay_ns));
}

TEST(NameClocks, OfATimecodeCountFrames) {
  std::vector<std::string> names;
  std::vector<int64_t> truth;
  for (int frame = 20; frame < 60; ++frame) {
    names.push_back(absl::StrFormat("shot_01_00_%02d_%02d", frame / 25, frame % 25));
    truth.push_back(kHour + frame * 40 * kMsInNs);
  }
  EXPECT_EQ(Clocks(names), truth);
  EXPECT_EQ(ClocksInNames(names)->timecode_fps, 25);
  EXPECT_EQ(FrameSteps(names).Between(4, 5), 1);
}

TEST(NameClocks, NumbersOfFramesAreNone) {
  const auto expect_none = [](const std::vector<std::string>& names) {
    EXPECT_FALSE(ClocksInNames(names)) << names.front() << " to " << names.back();
  };
  const auto count = [](const char* form, int64_t from, int64_t step, int frames) {
    std::vector<std::string> names;
    for (int i = 0; i < frames; ++i) names.push_back(absl::StrFormat("%0*d", form[0] - '0', from + step * i));
    return names;
  };
  expect_none(count("6", 0, 1, 300));
  expect_none(count("6", 101500, 1, 40));
  expect_none(count("9", 0, 40, 300));
  expect_none(count("9", 101559900, 10, 40));
  expect_none(count("8", 20210601, 1, 24));  // days
  expect_none(count("8", 10150200, 1, 24));
  expect_none({"20210616_000001", "20210616_000002"});
  expect_none({"20210616_101502_010", "20210616_101502_020"});
  expect_none({"101560001", "101560034"});
  expect_none({"240000001", "240000034"});
  expect_none({"2021-06-16_10-75-01.980", "2021-06-16_10-75-02.020"});
  expect_none({"a", "b"});
  expect_none({"101502033"});
  expect_none({});
}

// Whatever the rate, the start and the digits: a clock is read as it was written, and frames are neighbours.
TEST(NameClocks, AreReadAsTheyWereWritten) {
  for (const double fps : {24.0, 29.97, 30.0, 59.94, 120.0}) {
    for (const int64_t start_ms : {3'599'000, 36'899'500, 86'000'000}) {
      for (const int digits : {3, 6, 9}) {
        std::vector<std::string> names;
        std::vector<int64_t> truth;
        const int64_t unit = static_cast<int64_t>(std::pow(10, 9 - digits));
        for (int frame = 0; frame < 4 * static_cast<int>(fps); ++frame) {
          const auto ns = start_ms * kMsInNs + static_cast<int64_t>(1e9 / fps * frame);
          truth.push_back(ns / unit * unit);
          names.push_back(absl::StrFormat("%02d%02d%02d%0*d", ns / kHour, ns / kMinute % 60,
                                          ns / kOneSecond % 60, digits, ns % kOneSecond / unit));
        }
        EXPECT_EQ(Clocks(names), truth) << fps << " from " << names.front();
        const FrameSteps steps(names);
        for (size_t i = 1; i < names.size(); ++i) EXPECT_EQ(steps.Between(i - 1, i), 1) << names[i];
      }
    }
  }
}

}  // namespace
}  // namespace weft
