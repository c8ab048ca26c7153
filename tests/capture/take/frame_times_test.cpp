#include "capture/take/frame_times.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

FrameTimes Times(const std::vector<std::string>& names, double fps = 0) {
  const auto times = TimesInNames(names, fps);
  EXPECT_TRUE(times.ok()) << times.status();
  EXPECT_TRUE(times.ok() && times->has_value()) << names[0];
  return times.ok() && *times ? **times : FrameTimes{};
}

bool HasTimes(const std::vector<std::string>& names, double fps = 0) {
  const auto times = TimesInNames(names, fps);
  EXPECT_TRUE(times.ok()) << times.status();
  return times.ok() && times->has_value();
}

TEST(FrameTimes, ReadsTimesSince1970InEveryUnit) {
  const FrameTimes ns = Times({"1623840123456789012", "1623840123490122345", "1623840123556789012"});
  EXPECT_THAT(ns.times_ns, ElementsAre(1623840123456789012, 1623840123490122345, 1623840123556789012));
  EXPECT_THAT(ns.numbers, ElementsAre(0, 1, 3));
  EXPECT_EQ(ns.words, "times in ns since 1970, usually 33.333 ms apart");
  EXPECT_THAT(Times({"1623840123456789", "1623840123490122"}).times_ns,
              ElementsAre(1623840123456789000, 1623840123490122000));
  EXPECT_THAT(Times({"1623840123456", "1623840123490"}).times_ns,
              ElementsAre(1623840123456000000, 1623840123490000000));
  EXPECT_THAT(Times({"1305031102.175304", "1305031102.211214"}).times_ns,
              ElementsAre(1305031102175304000, 1305031102211214000));
  EXPECT_THAT(Times({"1623840123456789012"}).times_ns, ElementsAre(1623840123456789012));
  // Whole seconds, where the rate says so.
  EXPECT_FALSE(HasTimes({"1623840123", "1623840124"}));
  EXPECT_THAT(Times({"1623840123", "1623840124"}, 1).times_ns,
              ElementsAre(1623840123000000000, 1623840124000000000));
}

TEST(FrameTimes, ReadsTimesFromAnyZeroWhereTheyAreRegular) {
  EXPECT_THAT(Times({"0", "33366700", "66733400", "133466800"}).numbers, ElementsAre(0, 1, 2, 4));
  EXPECT_THAT(Times({"812345678", "812379011", "812412344"}).times_ns,
              ElementsAre(812345678000, 812379011000, 812412344000));  // us
  EXPECT_THAT(Times({"0.000", "0.040", "0.080"}).times_ns, ElementsAre(0, 40000000, 80000000));
  // ms look like numbers of frames, but for the rate.
  EXPECT_FALSE(HasTimes({"0", "40", "80"}));
  EXPECT_THAT(Times({"0", "40", "80"}, 25).times_ns, ElementsAre(0, 40000000, 80000000));
  EXPECT_THAT(Times({"0000", "0033", "0067", "0100"}, 30).numbers, ElementsAre(0, 1, 2, 3));
}

TEST(FrameTimes, LeavesNumbersOfFramesAlone) {
  EXPECT_FALSE(HasTimes({"0000", "0001", "0002"}));
  EXPECT_FALSE(HasTimes({"0000", "0001", "0002"}, 30));
  EXPECT_FALSE(HasTimes({"0000", "0003", "0006"}, 30));
  EXPECT_FALSE(HasTimes({"20210616", "20210617"}, 30));                    // dates
  EXPECT_FALSE(HasTimes({"3000000001", "3000000002", "3000000003"}, 30));  // a camera's count
  EXPECT_FALSE(HasTimes({"0", "1000", "5000", "5001"}));
  EXPECT_FALSE(HasTimes({"frame_1", "frame_2"}, 30));
  EXPECT_FALSE(HasTimes({"9223372036854775806", "9223372036854775807"}, 30));
  EXPECT_FALSE(HasTimes({"99999999999999999999", "99999999999999999999999"}, 30));
  EXPECT_FALSE(HasTimes({"1.2.3", "1.2.4"}));
  EXPECT_FALSE(HasTimes({"9223372036.0", "9999999999.0"}));  // beyond 64 bits of ns
  EXPECT_FALSE(HasTimes({}));
}

TEST(FrameTimes, RefusesARateThatContradictsThem) {
  const auto times = TimesInNames({"1623840123456789012", "1623840123490122345"}, 25);
  EXPECT_EQ(times.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(times.status().message()),
              HasSubstr("33.333 ms apart, and 25 frames a second are 40.000"));
  // Every third frame of 30 a second.
  EXPECT_THAT(Times({"1623840123000", "1623840123100", "1623840123200"}, 30).numbers, ElementsAre(0, 3, 6));
}

TEST(FrameTimes, RefusesDecimalsThatAreNotInTheOrderOfTheirValues) {
  const auto times = TimesInNames({"1.5", "1.6", "1.55"}, 0);
  EXPECT_EQ(times.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(times.status().message()), HasSubstr("1.6 and 1.55 are decimals of other lengths"));
  EXPECT_THAT(Times({"1623840123.45", "1623840123.5", "1623840123.55"}, 20).numbers, ElementsAre(0, 1, 2));
}

TEST(FrameTimes, RiseWithTheNamesWhateverTheUnitAndRate) {
  const struct {
    int64_t ns;
    const char* name;
  } kUnits[] = {{1, "ns"}, {1000, "us"}, {1000000, "ms"}};
  for (const auto& [unit_ns, unit] : kUnits) {
    for (const double fps : {7.5, 24.0, 25.0, 29.97, 30.0, 59.94, 120.0, 400.0}) {
      for (const int64_t start_ns : {int64_t{946684800} * 1000000000, int64_t{1700000000123456789}}) {
        std::vector<std::string> names;
        std::vector<int64_t> truth_ns;
        for (int frame = 0; frame < 50; ++frame) {
          const int64_t time = (start_ns + static_cast<int64_t>(1e9 / fps * frame)) / unit_ns;
          names.push_back(absl::StrCat(time));
          truth_ns.push_back(time * unit_ns);
        }
        const FrameTimes times = Times(names);
        EXPECT_EQ(times.times_ns, truth_ns) << unit << " at " << fps;
        EXPECT_EQ(Times(names, fps).numbers.back(), 49u) << unit << " at " << fps;
      }
    }
  }
}

}  // namespace
}  // namespace weft
