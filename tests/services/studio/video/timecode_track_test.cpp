#include "services/studio/video/timecode_track.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "absl/strings/str_format.h"
#include "services/studio/video/camera_offsets.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

struct Track {
  int flags = 0, scale = 30000, duration = 1001, numbers = 30;
  int32_t sample = 0;
  int64_t pts = 0;
};

// As ffprobe prints a timecode track; times are in 1/30000 s.
std::string FlatOf(const Track& track) {
  const auto word = [](int value) {
    const auto bits = static_cast<uint32_t>(value);
    return absl::StrFormat("%04x %04x ", bits >> 16, bits & 0xffff);
  };
  return absl::StrFormat(
      "packets.packet.0.pts=%d\npackets.packet.0.data=\"\\n00000000: %s      ....\\n\"\n"
      "streams.stream.0.time_base=\"1/30000\"\n"
      "streams.stream.0.extradata=\"\\n00000000: %s%s%s%s ................\\n00000010: %02x00 0000   "
      "....\\n\"\n",
      track.pts, word(track.sample), word(0), word(track.flags), word(track.scale), word(track.duration),
      track.numbers);
}

v1::VideoFacts FactsOf(const Track& track, double film_fps) {
  v1::VideoFacts facts;
  facts.set_path("a.mov");
  facts.set_time_base_num(1);
  facts.set_time_base_den(1'000'000);
  for (int i = 0; i < 90; ++i) facts.add_frame_pts(std::llround(1e6 * i / film_fps));
  const absl::Status read = ParseTimecodeTrack(FlatOf(track), facts);
  EXPECT_TRUE(read.ok()) << read;
  return facts;
}

TEST(ParseTimecodeTrack, ReadsLabelRateAndMoment) {
  const v1::VideoFacts facts = FactsOf({.flags = 1, .sample = 1800, .pts = -30030}, 30000.0 / 1001);
  EXPECT_EQ(facts.timecode(), "00:01:00;02");
  EXPECT_NEAR(facts.timecode_fps(), 29.97, 0.001);
  EXPECT_TRUE(facts.is_timecode_fps_sure());
  EXPECT_NEAR(facts.timecode_at_s(), -1.001, 1e-9);
  // The first frame comes 30 labels after the track's.
  EXPECT_EQ(TimecodeText(*TimecodeOfFirst(facts)), "00:01:01;02");
}

TEST(ParseTimecodeTrack, CountsByTheTrackAndNotByTheFilm) {
  const v1::VideoFacts facts = FactsOf({.sample = 1800}, 60000.0 / 1001);
  EXPECT_NEAR(TimecodeRates({facts}).front(), 29.97, 0.001);
  EXPECT_NEAR(TimecodeOfFirst(facts)->Seconds(), 60.06, 1e-6);
  // A track of 60 in a film of 29.97 has 60 labels a second, as slow as the film.
  EXPECT_NEAR(TimecodeRates({FactsOf({.scale = 60000, .numbers = 60}, 30000.0 / 1001)}).front(), 59.94,
              0.001);
}

TEST(ParseTimecodeTrack, LeavesTheDayWhereTheNumberDoes) {
  const int day = 24 * 3600 * 25;
  EXPECT_EQ(FactsOf({.scale = 25, .duration = 1, .numbers = 25, .sample = -26}, 25).timecode(),
            "23:59:58:24");
  EXPECT_EQ(FactsOf({.scale = 25, .duration = 1, .numbers = 25, .sample = day + 26}, 25).timecode(),
            "00:00:01:01");
}

TEST(ParseTimecodeTrack, SaysWhatIsMissing) {
  const auto status = [](const std::string& flat) {
    v1::VideoFacts facts;
    return ParseTimecodeTrack(flat, facts);
  };
  EXPECT_TRUE(absl::IsNotFound(status("")));
  EXPECT_TRUE(absl::IsNotFound(status(FlatOf({.duration = 0}))));
  EXPECT_THAT(std::string(status(FlatOf({.flags = 1, .scale = 25, .duration = 1, .numbers = 25})).message()),
              HasSubstr("a rate that timecode does not have"));
}

TEST(TimecodeTrackOf, IsTheOneThatTheVideoNames) {
  const std::string two =
      "streams.stream.0.codec_type=\"video\"\nstreams.stream.0.tags.timecode=\"10:00:00:00\"\n"
      "streams.stream.1.codec_tag_string=\"tmcd\"\nstreams.stream.1.tags.timecode=\"11:00:00:00\"\n"
      "streams.stream.2.codec_tag_string=\"tmcd\"\nstreams.stream.2.tags.timecode=\"10:00:00:00\"\n";
  EXPECT_EQ(TimecodeTrackOf(ValuesOf(two)), 2);
  EXPECT_EQ(TimecodeTrackOf(ValuesOf("streams.stream.1.codec_tag_string=\"tmcd\"\n")), 1);
  EXPECT_EQ(TimecodeTrackOf(ValuesOf("streams.stream.0.codec_type=\"video\"\n")), -1);
}

// A phone writes the mean of its frames: here of 30 a second, with one that is late.
Track OfPhone() { return {.scale = 19200, .duration = 641, .numbers = 30, .sample = 1'120'602}; }

TEST(TimecodeRates, MeanRatesAreThoseOfTheFilmsFrames) {
  EXPECT_FALSE(FactsOf(OfPhone(), 30).is_timecode_fps_sure());
  EXPECT_EQ(TimecodeRates({FactsOf(OfPhone(), 30)}).front(), 30);
  EXPECT_NEAR(TimecodeRates({FactsOf(OfPhone(), 30000.0 / 1001)}).front(), 29.97, 0.001);
  // Means may be near another standard's rate.
  Track late = OfPhone();
  late.scale = 29976;
  late.duration = 1000;
  EXPECT_EQ(TimecodeRates({FactsOf(late, 30)}).front(), 30);
}

TEST(TimecodeRates, DoubtfulOnesFollowTheOthers) {
  const v1::VideoFacts doubtful = FactsOf(OfPhone(), 29.9);
  Track exact = OfPhone();
  exact.scale = 30;
  exact.duration = 1;
  EXPECT_EQ(TimecodeRates({doubtful, FactsOf(exact, 30)}).front(), 30);
  exact.scale = 30000;
  exact.duration = 1001;
  EXPECT_NEAR(TimecodeRates({doubtful, FactsOf(exact, 30)}).front(), 29.97, 0.001);
  const std::vector<double> alone = TimecodeRates({doubtful, FactsOf(OfPhone(), 29.91)});
  EXPECT_EQ(alone[0], alone[1]);
}

TEST(OffsetsByTimecode, ClipsOnBothSidesOfMidnightAreNear) {
  for (const auto& [flags, scale, duration] :
       {std::tuple{0, 30000, 1001}, std::tuple{1, 30000, 1001}, std::tuple{0, 30, 1}}) {
    const int dropped = flags == 1 ? 2592 : 0;  // labels a day: 108 an hour
    const double fps = static_cast<double>(scale) / duration;
    const int day = 24 * 3600 * 30 - dropped;
    const Track before{.flags = flags, .scale = scale, .duration = duration, .sample = day - 15};
    const Track after{.flags = flags, .scale = scale, .duration = duration, .sample = 30};
    const auto syncs = OffsetsByTimecode({FactsOf(before, fps), FactsOf(after, fps)});
    ASSERT_TRUE(syncs.ok()) << syncs.status();
    EXPECT_NEAR((*syncs)[1].offset_s() - (*syncs)[0].offset_s(), 45 / fps, 1e-6);
  }
}

TEST(OffsetsByTimecode, ALabelOfTwoFramesIsLessSure) {
  const auto syncs =
      OffsetsByTimecode({FactsOf({}, 30000.0 / 1001), FactsOf({.sample = 24}, 60000.0 / 1001)});
  ASSERT_TRUE(syncs.ok()) << syncs.status();
  EXPECT_NEAR((*syncs)[1].offset_s() - (*syncs)[0].offset_s(), 0.8008, 1e-6);
  EXPECT_NEAR((*syncs)[1].offset_sigma_s(), 1.001 / 30 / std::sqrt(12), 1e-6);
}

}  // namespace
}  // namespace weft
