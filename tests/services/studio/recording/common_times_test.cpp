#include "services/studio/recording/common_times.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/capture/temp_folder.h"
#include "tests/services/studio/recording/recorded_pattern.h"

namespace weft {
namespace {

using ::testing::Optional;

constexpr int64_t kMilli_ns = 1'000'000;
constexpr int64_t kOneSecond_ns = 1000 * kMilli_ns;
constexpr int64_t kTakeStart_ns = 1'700'000'000 * kOneSecond_ns;

// When a frame was taken by the camera's clock, and arrived by the host's; none: it is missing.
struct Moment {
  int64_t device_ns, host_ns;
};
using Moments = std::vector<std::optional<Moment>>;  // of each camera

class CommonTimesTest : public ::testing::Test {
 protected:
  // Sets are numbered as they come, `skipped` ones excepted.
  void Record(const std::vector<std::string>& cameras, const std::vector<Moments>& moments,
              uint64_t skipped = 0) {
    PatternFrames frames(cameras, 16, 8);
    std::vector<RawFrameSet> sets;
    uint64_t number = 0;
    for (const Moments& moment : moments) {
      if (number == skipped && skipped > 0) ++number;
      RawFrameSet set = frames.Set(number++), some;
      some.number = set.number;
      some.device_time_ns = kTakeStart_ns;
      for (size_t camera = 0; camera < cameras.size(); ++camera) {
        if (!moment[camera]) {
          some.missing.push_back({cameras[camera], "packets lost"});
          continue;
        }
        set.frames[camera].device_time_ns = moment[camera]->device_ns;
        set.frames[camera].host_time_ns = moment[camera]->host_ns;
        some.frames.push_back(set.frames[camera]);
      }
      sets.push_back(some);
    }
    RecordSets(folder_ / "take", cameras, sets);
    auto take = RecordedTake::Open(folder_ / "take");
    ASSERT_TRUE(take.ok()) << take.status();
    take_ = *std::move(take);
    for (const std::string& id : cameras) description_.add_cameras()->set_id(id);
  }
  void Read(const std::string& camera, int64_t host_ns, int64_t device_minus_host_ns,
            int64_t uncertainty_ns = kMilli_ns / 10) {
    readings_.push_back({camera, {host_ns, device_minus_host_ns, uncertainty_ns, "", {}}});
  }
  CommonTimes Times() const { return CommonTimes(*take_, readings_, description_); }

  const TempFolder folder_;
  std::unique_ptr<RecordedTake> take_;
  std::vector<LoggedReading> readings_;
  v1::Take description_;
};

TEST_F(CommonTimesTest, ThoseOfSynchronizedClocksWithoutReadingsAreTheDevices) {
  Record({"a", "b", "c"}, {{Moment{10, 20}, Moment{16, 26}, Moment{12, 22}},
                           {Moment{110, 120}, {}, Moment{113, 123}},
                           {{}, {}, {}}});
  const CommonTimes times = Times();
  EXPECT_THAT(times.Time_ns(0, 0), Optional(10));
  EXPECT_THAT(times.Time_ns(0, 1), Optional(16));
  EXPECT_EQ(times.Time_ns(1, 1), std::nullopt);
  EXPECT_THAT(times.Median_ns(0), Optional(12));
  EXPECT_THAT(times.Spread_ns(0), Optional(6));
  EXPECT_THAT(times.Median_ns(1), Optional(113));  // the upper one of two
  EXPECT_THAT(times.Spread_ns(1), Optional(3));
  EXPECT_EQ(times.Median_ns(2), std::nullopt);
  EXPECT_EQ(times.Spread_ns(2), std::nullopt);
  EXPECT_FALSE(times.AreReadingsWrong(0));
}

TEST_F(CommonTimesTest, CamerasWithoutTriggerCountOnlyWhereNoOtherHasAFrame) {
  Record({"a", "b", "c"}, {{Moment{10, 20}, Moment{14, 24}, Moment{90, 95}}, {{}, {}, Moment{190, 195}}});
  description_.mutable_cameras(2)->set_unsynchronized(true);
  // The take does not know of it.
  description_.add_cameras()->set_id("nobody");
  const CommonTimes times = Times();
  EXPECT_THAT(times.Spread_ns(0), Optional(4));
  EXPECT_THAT(times.Median_ns(0), Optional(14));
  EXPECT_THAT(times.Median_ns(1), Optional(190));
}

// The clock gains 1 ms in the 10 s between its readings.
TEST_F(CommonTimesTest, OwnClocksAreConvertedByTheReadingsOnBothSides) {
  const auto at = [](int64_t seconds, int64_t minus_host_ns) {
    const int64_t taken_ns = kTakeStart_ns + seconds * kOneSecond_ns;
    return Moments{Moment{taken_ns + minus_host_ns, taken_ns}};
  };
  Record({"a"}, {at(0, 7), at(10, 7), at(15, 7), at(20, 7), at(40, 7)});
  Read("a", kTakeStart_ns + 10 * kOneSecond_ns, 0);
  Read("a", kTakeStart_ns + 20 * kOneSecond_ns, kMilli_ns);
  description_.set_own_clocks(true);
  const CommonTimes times = Times();
  const auto minus_taken_ns = [&](size_t set, int64_t seconds) {
    return *times.Time_ns(set, 0) - kTakeStart_ns - seconds * kOneSecond_ns;
  };
  EXPECT_EQ(minus_taken_ns(0, 0), 7);
  EXPECT_EQ(minus_taken_ns(1, 10), 7);
  EXPECT_EQ(minus_taken_ns(2, 15), 7 - kMilli_ns / 2);
  EXPECT_EQ(minus_taken_ns(3, 20), 7 - kMilli_ns);
  EXPECT_EQ(minus_taken_ns(4, 40), 7 - kMilli_ns);
}

TEST_F(CommonTimesTest, AnswersThatTookMoreThanFourTimesTheMedianSayNothing) {
  Record({"a"}, {{Moment{kTakeStart_ns, kTakeStart_ns}}});
  description_.set_own_clocks(true);
  for (const int64_t uncertainty_ns : {4 * kMilli_ns, 4 * kMilli_ns + 1}) {
    readings_.clear();
    Read("a", kTakeStart_ns - 3, 100, kMilli_ns);
    Read("a", kTakeStart_ns - 2, 100, kMilli_ns);
    Read("a", kTakeStart_ns - 1, 200, uncertainty_ns);
    EXPECT_THAT(Times().Time_ns(0, 0),
                Optional(kTakeStart_ns - (uncertainty_ns > 4 * kMilli_ns ? 100 : 200)));
  }
}

TEST_F(CommonTimesTest, ReadingsByWhichFramesArriveBeforeTheyAreTakenOrLongAfterAreWrong) {
  Record({"a"}, {{Moment{kTakeStart_ns, kTakeStart_ns}}});
  description_.set_own_clocks(true);
  // Lateness of the frame by the reading is device_minus_host_ns.
  for (const auto& [lateness_ns, is_wrong] :
       std::vector<std::pair<int64_t, bool>>{{-50 * kMilli_ns - 1, true},
                                             {-50 * kMilli_ns, false},
                                             {0, false},
                                             {10 * kOneSecond_ns, false},
                                             {10 * kOneSecond_ns + 1, true}}) {
    readings_.clear();
    Read("a", kTakeStart_ns, lateness_ns);
    const CommonTimes times = Times();
    EXPECT_EQ(times.AreReadingsWrong(0), is_wrong) << lateness_ns;
    // The arrival counts instead: it was the quickest.
    EXPECT_THAT(times.Time_ns(0, 0), Optional(is_wrong ? kTakeStart_ns : kTakeStart_ns - lateness_ns));
  }
}

// A clock that is 7 s off and never read: frames take 10 ms, and one in each window of 5 s takes 2 ms.
TEST_F(CommonTimesTest, AClockThatWasNotReadIsThatOfTheQuickestArrivals) {
  std::vector<Moments> sets;
  for (int64_t half_seconds = 0; half_seconds <= 40; ++half_seconds) {
    const int64_t taken_ns = kTakeStart_ns + half_seconds * kOneSecond_ns / 2;
    sets.push_back(
        {Moment{taken_ns + 7 * kOneSecond_ns, taken_ns + (half_seconds % 10 == 3 ? 2 : 10) * kMilli_ns}});
  }
  Record({"a"}, sets);
  description_.mutable_cameras(0)->set_own_clock(true);
  const CommonTimes times = Times();
  EXPECT_FALSE(times.AreReadingsWrong(0));
  for (size_t set = 0; set < sets.size(); ++set)
    EXPECT_NEAR(
        static_cast<double>(*times.Time_ns(set, 0)),
        static_cast<double>(kTakeStart_ns + static_cast<int64_t>(set) * kOneSecond_ns / 2 + 2 * kMilli_ns),
        1e3)
        << set;
}

// Beside two whose clocks are synchronized, 1 s before the host's.
TEST_F(CommonTimesTest, OneClockOfItsOwnIsPutOnThatOfTheOthers) {
  Record({"a", "b", "c"}, {{Moment{kTakeStart_ns + kOneSecond_ns, kTakeStart_ns + kMilli_ns},
                            Moment{kTakeStart_ns + kOneSecond_ns, kTakeStart_ns + kMilli_ns},
                            Moment{kTakeStart_ns - 3 * kOneSecond_ns, kTakeStart_ns + kMilli_ns}}});
  Read("a", kTakeStart_ns, kOneSecond_ns);
  Read("b", kTakeStart_ns, kOneSecond_ns + 50);
  Read("c", kTakeStart_ns, -3 * kOneSecond_ns);
  description_.mutable_cameras(2)->set_own_clock(true);
  const CommonTimes times = Times();
  EXPECT_THAT(times.Time_ns(0, 0), Optional(kTakeStart_ns + kOneSecond_ns));
  EXPECT_THAT(times.Time_ns(0, 1), Optional(kTakeStart_ns + kOneSecond_ns));
  EXPECT_THAT(times.Time_ns(0, 2), Optional(kTakeStart_ns + kOneSecond_ns + 50));
}

TEST_F(CommonTimesTest, OfClocksThatAreAllTheirOwnTheHostsCounts) {
  Record({"a"}, {{Moment{kTakeStart_ns + kOneSecond_ns, kTakeStart_ns + kMilli_ns}}});
  Read("a", kTakeStart_ns, kOneSecond_ns);
  description_.mutable_cameras(0)->set_own_clock(true);
  EXPECT_THAT(Times().Time_ns(0, 0), Optional(kTakeStart_ns));
}

// Between two readings the clock jumped by 2 s. Frames arrive 4 ms late, before and after.
TEST_F(CommonTimesTest, AcrossAJumpTheReadingCountsWithWhichAFrameIsAsLateAsOthers) {
  std::vector<Moments> sets;
  for (int64_t second = 0; second < 10; ++second) {
    const int64_t taken_ns = kTakeStart_ns + second * kOneSecond_ns;
    sets.push_back({Moment{taken_ns + (second < 4 ? 0 : 2 * kOneSecond_ns), taken_ns + 4 * kMilli_ns}});
  }
  Record({"a"}, sets);
  Read("a", kTakeStart_ns, 0);
  Read("a", kTakeStart_ns + 9 * kOneSecond_ns, 2 * kOneSecond_ns);
  description_.set_own_clocks(true);
  const CommonTimes times = Times();
  for (size_t set = 0; set < sets.size(); ++set)
    EXPECT_THAT(times.Time_ns(set, 0), Optional(kTakeStart_ns + static_cast<int64_t>(set) * kOneSecond_ns))
        << set;
}

TEST_F(CommonTimesTest, DescribesIntervalsOffsetsAndDuration) {
  // 100 ms and 110 ms between the first three; set 3 was dropped, so that no interval leads over it.
  const auto at = [](int64_t a_ms, std::optional<int64_t> b_ms) {
    Moments moments{
        Moment{a_ms * kMilli_ns, a_ms * kMilli_ns}, {}, Moment{a_ms * kMilli_ns, a_ms * kMilli_ns}};
    if (b_ms) moments[1] = Moment{*b_ms * kMilli_ns, *b_ms * kMilli_ns};
    return moments;
  };
  Record({"a", "b", "c"}, {at(1000, 1001), at(1100, 1103), at(1210, {}), at(1500, 1498)}, 3);
  v1::TakeInfo info;
  DescribeTiming(*take_, Times(), info);
  ASSERT_EQ(info.timing_size(), 3);
  const v1::TakeTiming& a = info.timing(0);
  EXPECT_EQ(a.camera(), "a");
  EXPECT_EQ(a.frames(), 4u);
  EXPECT_EQ(a.missing(), 0u);
  EXPECT_DOUBLE_EQ(a.interval_mean_ms(), 105);
  EXPECT_NEAR(a.interval_jitter_ms(), 5, 1e-6);
  EXPECT_DOUBLE_EQ(a.offset_mean_ms(), 0);
  const v1::TakeTiming& b = info.timing(1);
  EXPECT_EQ(b.frames(), 3u);
  EXPECT_EQ(b.missing(), 1u);
  EXPECT_DOUBLE_EQ(b.interval_mean_ms(), 102);
  EXPECT_DOUBLE_EQ(b.interval_jitter_ms(), 0);
  EXPECT_NEAR(b.offset_mean_ms(), 2.0 / 3, 1e-9);         // 1, 3 and -2
  EXPECT_NEAR(b.offset_jitter_ms(), 2.0548046677, 1e-6);  // the root of 38/9
  EXPECT_DOUBLE_EQ(b.offset_worst_ms(), 3);
  EXPECT_DOUBLE_EQ(info.duration_s(), 0.5);
}

TEST(Spread, IsThatOfItsNumbers) {
  Spread none;
  EXPECT_EQ(none.mean(), 0);
  EXPECT_EQ(none.rms(), 0);
  EXPECT_EQ(none.deviation(), 0);
  Spread some;
  for (const double value : {-5.0, 1.0, 1.0, 3.0}) some.Add(value);
  EXPECT_EQ(some.count, 4u);
  EXPECT_DOUBLE_EQ(some.mean(), 0);
  EXPECT_DOUBLE_EQ(some.rms(), 3);
  EXPECT_DOUBLE_EQ(some.deviation(), 3);
  EXPECT_DOUBLE_EQ(some.worst, 5);
}

}  // namespace
}  // namespace weft
