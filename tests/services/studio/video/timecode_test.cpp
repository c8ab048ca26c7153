#include "services/studio/video/timecode.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace weft {
namespace {

using ::testing::HasSubstr;

TEST(Timecode, CountsEveryFrameWhereNothingIsDropped) {
  const auto timecode = ParseTimecode("10:22:33:12", 25);
  ASSERT_TRUE(timecode.ok()) << timecode.status();
  EXPECT_EQ(timecode->Number(), ((10 * 60 + 22) * 60 + 33) * 25 + 12);
  EXPECT_NEAR(timecode->Seconds(), 37353.48, 1e-9);
  EXPECT_EQ(TimecodeText(*timecode), "10:22:33:12");
}

TEST(Timecode, LeavesOutTwoNumbersAMinuteButEveryTenth) {
  const double fps = 30000.0 / 1001;
  const auto before = ParseTimecode("00:00:59;29", fps), after = ParseTimecode("00:01:00;02", fps);
  ASSERT_TRUE(before.ok() && after.ok());
  EXPECT_EQ(after->Number(), before->Number() + 1);
  EXPECT_EQ(ParseTimecode("00:10:00;00", fps)->Number(), ParseTimecode("00:09:59;29", fps)->Number() + 1);
  // A day of it lasts a day, to a fifth of a second.
  EXPECT_NEAR(ParseTimecode("23:59:59;29", fps)->Seconds(), 86400, 0.2);
  // Without dropping, an hour of 29.97 lasts 3.6 s longer.
  EXPECT_NEAR(ParseTimecode("01:00:00:00", fps)->Seconds(), 3603.6, 1e-6);
}

TEST(Timecode, NumbersGiveBackTheirText) {
  for (const auto& [text, fps] :
       {std::pair{"00:00:00:00", 24.0}, std::pair{"23:59:59:49", 50.0},
        std::pair{"00:09:59;29", 30000.0 / 1001}, std::pair{"01:11:00;02", 29.97},
        std::pair{"10:20:00;00", 29.97}, std::pair{"00:01:00;04", 60000.0 / 1001}}) {
    const auto timecode = ParseTimecode(text, fps);
    ASSERT_TRUE(timecode.ok()) << timecode.status();
    EXPECT_EQ(TimecodeText(TimecodeOf(timecode->Number(), *timecode)), text);
  }
  const Timecode like = *ParseTimecode("00:00:00;00", 29.97);
  Timecode last = like;
  for (int64_t number = 1; number < 40000; ++number) {
    const Timecode next = TimecodeOf(number, like);
    ASSERT_EQ(next.Number(), number) << TimecodeText(last) << " " << TimecodeText(next);
    last = next;
  }
  EXPECT_EQ(TimecodeText(TimecodeOf(-1, like)), "23:59:59;29");
}

TEST(Timecode, TakesWhatOthersWrite) {
  const auto text = [](std::string_view label, double fps) {
    return TimecodeText(*ParseTimecode(label, fps));
  };
  EXPECT_EQ(text("25:10:00:03", 25), "01:10:00:03");
  EXPECT_EQ(text("-00:00:01:00", 25), "23:59:59:00");
  EXPECT_EQ(text("10:00:00:119", 120), "10:00:00:119");
  EXPECT_EQ(text("10:00:00,12", 29.97), "10:00:00;12");
  EXPECT_EQ(text("10:00:00.12", 29.97), "10:00:00;12");
}

TEST(Timecode, ADayOfLabelsIsNoDayOfTheClock) {
  EXPECT_NEAR(ParseTimecode("00:00:00:00", 30000.0 / 1001)->Day_s(), 86486.4, 1e-6);
  EXPECT_NEAR(ParseTimecode("00:00:00;00", 30000.0 / 1001)->Day_s(), 86399.9136, 1e-6);
  EXPECT_NEAR(ParseTimecode("00:00:00:00", 24)->Day_s(), 86400, 1e-6);
}

TEST(Timecode, HasTwoDigitsEachAndOneToThreeOfFrames) {
  const auto is_read = [](std::string_view text) { return ParseTimecode(text, 120).ok(); };
  for (const char* good : {"10:22:33:1", "10:22:33:001", "00010:22:33:00", "10:59:59:119"})
    EXPECT_TRUE(is_read(good)) << good;
  for (const char* bad : {"1:22:33:00", "10:2:33:00", "10:22:3:00", "10:22:33:", "10:22:33:0001",
                          "10:22:33:00x", "10:022:33:00", "10;22:33:00", "10:22;33:00", "000010:22:33:00",
                          "-", "", "10:60:00:00", "10:00:60:00", "10:22:33:120", "+10:22:33:00"})
    EXPECT_FALSE(is_read(bad)) << bad;
  EXPECT_EQ(ParseTimecode("10:22:33:00", 120.4)->nominal_fps, 120);
  EXPECT_TRUE(ParseTimecode("10:22:33:239", 240).ok());
  EXPECT_FALSE(ParseTimecode("10:22:33:00", 241).ok());
  EXPECT_FALSE(ParseTimecode("10:22:33:00", 0.5).ok());
  EXPECT_EQ(ParseTimecode("10:00:00;05", 60000.0 / 1001)->Number(),
            int64_t{36000} * 60 + 5 - int64_t{4} * (600 - 60));
  EXPECT_FALSE(ParseTimecode("10:01:00;03", 60000.0 / 1001).ok()) << "four are dropped";
}

TEST(StandardRate, TellsRatesOfAThousandthApart) {
  for (const int nominal : {24, 25, 30, 48, 50, 60, 120}) {
    EXPECT_FALSE(StandardRate(nominal)->is_slow);
    EXPECT_TRUE(StandardRate(nominal / 1.001, kWrittenExactly)->is_slow);
    EXPECT_EQ(StandardRate(nominal / 1.001)->nominal_fps, nominal);
  }
  EXPECT_TRUE(StandardRate(23.98)->is_slow);
  EXPECT_TRUE(StandardRate(59.94, kWrittenExactly)->is_slow);
  EXPECT_FALSE(StandardRate(29.976, kWrittenExactly));
  EXPECT_FALSE(StandardRate(29.95));
  EXPECT_FALSE(StandardRate(0));
  EXPECT_FALSE(StandardRate(1e9));
}

TEST(Timecode, SaysWhatIsWrong) {
  const auto why = [](std::string_view text, double fps) {
    const auto timecode = ParseTimecode(text, fps);
    return timecode.ok() ? "" : std::string(timecode.status().message());
  };
  EXPECT_THAT(why("10:22:33", 25), HasSubstr("\"10:22:33\" is not HH:MM:SS:FF"));
  EXPECT_THAT(why("10:22:3x:00", 25), HasSubstr("is not HH:MM:SS:FF"));
  EXPECT_THAT(why("10:62:33:00", 25), HasSubstr("no time of a day"));
  EXPECT_THAT(why("10:22:33:25", 25), HasSubstr("more frames"));
  EXPECT_THAT(why("10:22:33;12", 25), HasSubstr("drops frame numbers"));
  EXPECT_THAT(why("10:01:00;01", 29.97), HasSubstr("one of those that are dropped"));
  EXPECT_THAT(why("10:22:33:12", 12.4), HasSubstr("no such rate"));
  EXPECT_THAT(why("10:22:33:12", 0), HasSubstr("no such rate"));
}

}  // namespace
}  // namespace weft
