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

TEST(TimecodeTrackOf, LooksAtSixtyFourStreams) {
  EXPECT_EQ(TimecodeTrackOf(ValuesOf("streams.stream.63.codec_tag_string=\"tmcd\"\n")), 63);
  EXPECT_EQ(TimecodeTrackOf(ValuesOf("streams.stream.64.codec_tag_string=\"tmcd\"\n")), -1);
  // Of several that the video does not name, the first.
  EXPECT_EQ(TimecodeTrackOf(ValuesOf("streams.stream.2.codec_tag_string=\"tmcd\"\n"
                                     "streams.stream.1.codec_tag_string=\"tmcd\"\n"
                                     "streams.stream.0.codec_type=\"video\"\n"
                                     "streams.stream.0.tags.timecode=\"10:00:00:00\"\n")),
            1);
}

TEST(ParseTimecodeTrack, TakesAtMostWhatTimecodeCounts) {
  const auto fps_of = [](const Track& track) {
    v1::VideoFacts facts;
    const absl::Status status = ParseTimecodeTrack(FlatOf(track), facts);
    EXPECT_TRUE(status.ok() || absl::IsInvalidArgument(status)) << status;
    return facts.timecode_fps();
  };
  EXPECT_EQ(fps_of({.scale = 240, .duration = 1, .numbers = 240}), 240);
  EXPECT_EQ(fps_of({.scale = 241, .duration = 1, .numbers = 241}), 0);
  EXPECT_EQ(fps_of({.flags = 1, .scale = 25, .duration = 1, .numbers = 25}), 0);
  EXPECT_EQ(fps_of({.flags = 2, .scale = 25, .duration = 1, .numbers = 25}), 25) << "another flag";
  EXPECT_EQ(fps_of({.scale = 25, .duration = 1, .numbers = 0}), 25) << "no number of its own";
  EXPECT_EQ(fps_of({.flags = 1, .scale = 60000, .duration = 1001, .numbers = 60}), 60 * 1000.0 / 1001);
  v1::VideoFacts facts;
  std::string no_sample = FlatOf({});
  no_sample.replace(no_sample.find("packets.packet.0.pts"), 20, "packets.packet.1.pts");
  EXPECT_EQ(ParseTimecodeTrack(no_sample, facts).message(), "its timecode track is empty");
  EXPECT_EQ(ParseTimecodeTrack(FlatOf({.scale = 0}), facts).message(), "its timecode track has no rate");
  EXPECT_EQ(ParseTimecodeTrack("", facts).message(), "its timecode track is not described");
}

v1::VideoFacts FilmOf(double fps, int frames, double declared_fps) {
  v1::VideoFacts facts;
  facts.set_time_base_num(1);
  facts.set_time_base_den(1'000'000);
  facts.set_declared_fps(declared_fps);
  for (int i = 0; i < frames; ++i) facts.add_frame_pts(std::llround(1e6 * i / fps));
  return facts;
}

TEST(TimecodeRates, WithoutATrackAreThoseOfTheFilm) {
  EXPECT_EQ(TimecodeRates({FilmOf(25, 50, 0)}).front(), 25);
  EXPECT_EQ(TimecodeRates({FilmOf(25, 50, 50)}).front(), 25) << "its frames go before its header";
  EXPECT_EQ(TimecodeRates({FilmOf(25, 1, 24)}).front(), 24) << "one frame has no rate";
  EXPECT_EQ(TimecodeRates({FilmOf(25, 1, 0)}).front(), 0);
  // Near no standard's rate: whole frames a second, and whether slow as it is nearer to.
  EXPECT_DOUBLE_EQ(TimecodeRates({FilmOf(28.7, 90, 0)}).front(), 29 * 1000.0 / 1001);
  EXPECT_EQ(TimecodeRates({FilmOf(29.3, 90, 0)}).front(), 29);
  EXPECT_EQ(TimecodeRates({FilmOf(12.4, 90, 0)}).front(), 0) << "two hundredths from whole ones";
  // Of several doubtful ones the first tells.
  const std::vector<double> both = TimecodeRates({FilmOf(29.3, 90, 0), FilmOf(28.7, 90, 0)});
  EXPECT_EQ(both[0], 29);
  EXPECT_EQ(both[1], 29);
}

TEST(LabelOf, NamesTheFile) {
  v1::VideoFacts facts;
  facts.set_path("a.mov");
  EXPECT_TRUE(absl::IsNotFound(LabelOf(facts, 25).status()));
  EXPECT_EQ(LabelOf(facts, 25).status().message(), "a.mov: has no timecode");
  facts.set_timecode("10:00:00:07");
  facts.set_timecode_at_s(1.5);
  const auto label = LabelOf(facts, 25);
  ASSERT_TRUE(label.ok()) << label.status();
  EXPECT_EQ(label->at_s, 1.5);
  EXPECT_EQ(label->timecode.frames, 7);
  facts.set_timecode("10:00:00:27");
  EXPECT_THAT(std::string(LabelOf(facts, 25).status().message()), HasSubstr("a.mov: the timecode"));
  EXPECT_EQ(TimecodeText(*TimecodeOfFirst([&] {
              facts = FilmOf(25, 0, 25);
              facts.set_timecode("10:00:00:07");
              return facts;
            }())),
            "10:00:00:07")
      << "no frames";
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
