#include "capture/take/frame_times.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

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

// Rounded to units of `unit_ns`, with `before` in front.
std::vector<std::string> FilmNames(const std::string& before, int64_t start_ns, double fps, int64_t unit_ns,
                                   int frames = 40) {
  std::vector<std::string> names;
  for (int i = 0; i < frames; ++i) {
    const double ns = static_cast<double>(start_ns) + 1e9 / fps * i;
    names.push_back(absl::StrCat(before, std::llround(ns / static_cast<double>(unit_ns))));
  }
  return names;
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

TEST(FrameTimes, MayHaveTextBeforeAndBehindThem) {
  constexpr int64_t kBoot_ns = 482'311'234'567'890, kSinceBoot_ns = 12'345'678'901;
  for (const auto& [start_ns, unit_ns] : {std::pair(kBoot_ns, int64_t{1}),
                                          {kBoot_ns, 1000},
                                          {kSinceBoot_ns, 1},
                                          {kSinceBoot_ns, 1000},
                                          {1'623'840'123'456'789'012, 1000},
                                          {1'623'840'123'456'789'012, 1'000'000}}) {
    const std::vector<std::string> names = FilmNames("frame_", start_ns, 30, unit_ns);
    const FrameTimes times = Times(names);
    EXPECT_EQ(times.times_ns.front(), std::llround(double(start_ns) / double(unit_ns)) * unit_ns) << names[0];
    EXPECT_EQ(times.numbers.back(), 39u) << names[0];
  }
  EXPECT_THAT(Times({"t_0.960", "t_1.000", "t_1.040"}).times_ns,
              ElementsAre(960000000, 1000000000, 1040000000));
  // Beyond any number of frames, so they need not be regular.
  EXPECT_THAT(Times({"f482311234567890", "f482311261567890", "f482311321567890", "f482311345567890"}).numbers,
              ElementsAre(0, 1, 3, 4));
}

TEST(FrameTimes, OfDayAreReadAsClocks) {
  const FrameTimes times = Times({"101559933", "101559967", "101600000", "101600067"});
  EXPECT_THAT(times.numbers, ElementsAre(0, 1, 2, 4));
  EXPECT_EQ(times.times_ns[2], (10 * 3600 + 16 * 60) * int64_t{1'000'000'000});
  EXPECT_THAT(times.words, HasSubstr("times of day, usually 33."));
  const auto midnight = TimesInNames({"000000040", "000000080", "235959960"}, 0, NameMeaning::kClock);
  EXPECT_EQ(midnight.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(midnight.status().message()), HasSubstr("goes over midnight"));
}

TEST(FrameTimes, InMsAreKnownByTheirRounding) {
  for (const double fps : {24.0, 30.0, 29.97, 60.0, 120.0, 15.0}) {
    for (const int64_t start_ns : {0, 1'000'000'000}) {
      for (const int frames : {40, 400}) {
        const std::vector<std::string> names = FilmNames("", start_ns, fps, 1'000'000, frames);
        const FrameTimes times = Times(names);
        EXPECT_EQ(times.numbers.back(), static_cast<uint64_t>(frames - 1)) << fps << " from " << names[0];
      }
    }
  }
  // Each fourth one dropped: the rate is that of all.
  std::vector<std::string> dropped;
  std::vector<uint64_t> truth;
  for (uint64_t i = 0; i < 3000; ++i) {
    if (i % 4 == 1) continue;
    dropped.push_back(absl::StrCat("img_", std::llround(1e3 / 30 * double(i))));
    truth.push_back(i);
  }
  EXPECT_EQ(Times(dropped).numbers, truth);
  EXPECT_THAT(Times(dropped).words, HasSubstr("usually 33.333 ms"));
  // Picked evenly from a film.
  EXPECT_FALSE(HasTimes(FilmNames("", 0, 1000.0 / 37.3, 1'000'000)));
  EXPECT_FALSE(HasTimes({"33", "67", "100"}));
}

TEST(FrameTimes, AreWhatTheyAreSaidToBe) {
  const auto as = [](NameMeaning meaning) {
    const auto times = TimesInNames({"f_000000", "f_000040", "f_000080", "f_000160"}, 0, meaning);
    EXPECT_TRUE(times.ok() && *times) << times.status();
    return times.ok() && *times ? **times : FrameTimes{};
  };
  EXPECT_THAT(as(NameMeaning::kMilliseconds).times_ns, ElementsAre(0, 40000000, 80000000, 160000000));
  EXPECT_THAT(as(NameMeaning::kMilliseconds).numbers, ElementsAre(0, 1, 2, 4));
  EXPECT_THAT(as(NameMeaning::kMicroseconds).times_ns, ElementsAre(0, 40000, 80000, 160000));
  EXPECT_THAT(as(NameMeaning::kSeconds).times_ns, ElementsAre(0, 40e9, 80e9, 160e9));
  EXPECT_FALSE(*TimesInNames({"1623840123456789012", "1623840123490122345"}, 0, NameMeaning::kNumbers));
  EXPECT_EQ(TimesInNames({"a", "b"}, 0, NameMeaning::kMilliseconds).status().code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(TimesInNames({"0001", "0002"}, 0, NameMeaning::kClock).status().code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(TimesInNames({"9223372036854775806", "9223372036854775807"}, 0, NameMeaning::kMilliseconds)
                .status()
                .code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(*NameMeaningFromName("ms"), NameMeaning::kMilliseconds);
  EXPECT_FALSE(NameMeaningFromName("m").ok());
}

TEST(FrameTimes, NumbersThatMayBeTimesAreSaid) {
  EXPECT_THAT(DoubtOfNumbers({"000000", "000040", "000080"}), HasSubstr("rise by 40; where they are times"));
  EXPECT_EQ(DoubtOfNumbers({"0000", "0001", "0002"}), "");
  EXPECT_EQ(DoubtOfNumbers({"0000", "0003", "0006"}), "");
  EXPECT_EQ(DoubtOfNumbers({"a", "b"}), "");
  EXPECT_EQ(DoubtOfNumbers({"0000"}), "");
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
  // As programs print them: 0.5 comes before 0.25 by its name.
  const auto whole = TimesInNames({"0", "0.5", "0.25", "0.75", "1", "1.25"}, 0);
  EXPECT_THAT(std::string(whole.status().message()), HasSubstr("0.5 and 0.25 are decimals of other lengths"));
  EXPECT_THAT(Times({"0", "0.5", "1", "1.5"}).times_ns,
              ElementsAre(0, 500'000'000, 1'000'000'000, 1'500'000'000));
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
