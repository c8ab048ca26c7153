#include "services/studio/video/ltc.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <ltc.h>

#include <filesystem>
#include <memory>
#include <random>

#include "services/studio/video/import_videos.h"
#include "services/studio/video/video_facts.h"
#include "tests/services/studio/video/made_video.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

// Sound with timecode from this text on, `frames` of it, after `silence` samples; 48 kHz.
std::vector<int16_t> Sound(const std::string& text, double fps, int frames, int silence) {
  const std::unique_ptr<LTCEncoder, void (*)(LTCEncoder*)> encoder(
      ltc_encoder_create(48000, fps, fps == 25 ? LTC_TV_625_50 : LTC_TV_525_60, 0), &ltc_encoder_free);
  SMPTETimecode time = {};
  time.hours = static_cast<unsigned char>(std::stoi(text.substr(0, 2)));
  time.mins = static_cast<unsigned char>(std::stoi(text.substr(3, 2)));
  time.secs = static_cast<unsigned char>(std::stoi(text.substr(6, 2)));
  time.frame = static_cast<unsigned char>(std::stoi(text.substr(9, 2)));
  ltc_encoder_set_timecode(encoder.get(), &time);
  if (text[8] == ';') {
    LTCFrame frame;
    ltc_encoder_get_frame(encoder.get(), &frame);
    frame.dfbit = 1;
    ltc_encoder_set_frame(encoder.get(), &frame);
  }
  std::vector<int16_t> samples(static_cast<size_t>(silence), 0);
  for (int i = 0; i < frames; ++i) {
    ltc_encoder_encode_frame(encoder.get());
    ltcsnd_sample_t* bytes = nullptr;
    const int size = ltc_encoder_get_bufferptr(encoder.get(), &bytes, 1);
    for (int at = 0; at < size; ++at) samples.push_back(static_cast<int16_t>((bytes[at] - 128) * 100));
    ltc_encoder_inc_timecode(encoder.get());
  }
  return samples;
}

TEST(ReadLtc, KnowsTimecodeAndWhenItBegins) {
  const auto reading = ReadLtc(Sound("10:22:33:12", 25, 50, 4800), 48000);
  ASSERT_TRUE(reading.ok()) << reading.status();
  // The decoder needs a frame or two to find in.
  const double zero_s = reading->first_s - reading->timecode.Seconds();
  EXPECT_NEAR(zero_s, 0.1 - (37353 + 12.0 / 25), 0.0005);
  EXPECT_EQ(reading->timecode.fps, 25);
  EXPECT_GT(reading->frames, 45);
  EXPECT_LT(reading->sigma_s, 0.0005);
}

TEST(ReadLtc, TellsRatesOfAThousandthLessApart) {
  const auto slow = ReadLtc(Sound("01:00:00:00", 30000.0 / 1001, 300, 0), 48000);
  ASSERT_TRUE(slow.ok()) << slow.status();
  EXPECT_NEAR(slow->timecode.fps, 29.97, 0.001);
  const auto dropped = ReadLtc(Sound("01:00:58;10", 30000.0 / 1001, 120, 0), 48000);
  ASSERT_TRUE(dropped.ok()) << dropped.status();
  EXPECT_TRUE(dropped->timecode.drops);
  const auto even = ReadLtc(Sound("01:00:00:00", 30, 300, 0), 48000);
  ASSERT_TRUE(even.ok()) << even.status();
  EXPECT_EQ(even->timecode.fps, 30);
}

TEST(ReadLtc, FindsNoneInNoise) {
  std::mt19937 random(7);
  std::vector<int16_t> noise(96000);
  for (int16_t& sample : noise) sample = static_cast<int16_t>(random());
  EXPECT_TRUE(absl::IsNotFound(ReadLtc(noise, 48000).status()));
  EXPECT_TRUE(absl::IsNotFound(ReadLtc({}, 48000).status()));
  EXPECT_TRUE(absl::IsNotFound(ReadLtc(Sound("10:00:00:00", 25, 5, 0), 48000).status()));
}

// The sound as a raw file, for ffmpeg.
void WriteSound(const std::string& path, const std::vector<int16_t>& samples) {
  WriteBytes(path, std::string(reinterpret_cast<const char*>(samples.data()), 2 * samples.size()));
}

// A film of `values` with timecode in its sound, which begins `silence` samples later.
void MakeFilm(const TempFolder& temp, const std::string& name, int first, int frames,
              const std::string& timecode, int silence) {
  const std::string picture = temp / (name + "-picture.mkv"), sound = temp / (name + ".raw");
  MakeVideo(picture, Values(first, frames), "25");
  WriteSound(sound, Sound(timecode, 25, 60, silence));
  Shell("ffmpeg -v error -i '" + picture + "' -f s16le -ar 48000 -ac 1 -i '" + sound +
        "' -map 0 -map 1 -c:v copy -c:a flac '" + (temp / (name + ".mkv")) + "'");
}

// A tone in the first stream; in the second one silence on the left, timecode on the right.
TEST(OffsetsByLtc, ListensToEveryChannelOfEveryStream) {
  const TempFolder temp;
  MakeVideo(temp / "a-picture.mkv", Values(10, 50), "25");
  WriteSound(temp / "a.raw", Sound("10:00:00:00", 25, 60, 5760));
  Shell("ffmpeg -v error -i '" + (temp / "a-picture.mkv") +
        "' -f lavfi -i sine=duration=2 -f lavfi -i anullsrc=cl=mono:r=48000:d=2.5 -f s16le -ar 48000 -ac 1 "
        "-i '" +
        (temp / "a.raw") +
        "' -filter_complex '[2:a][3:a]amerge=inputs=2[a]' -map 0 -map 1:a -map '[a]' -c:v copy -c:a flac '" +
        (temp / "a.mkv") + "'");
  auto facts = InspectVideo(std::filesystem::canonical(temp / "a.mkv").string());
  ASSERT_TRUE(facts.ok()) << facts.status();
  EXPECT_THAT(facts->audio_channels(), ::testing::ElementsAre(1, 2));
  facts->set_camera("a");
  std::vector<v1::VideoFacts> videos = {*facts};
  auto syncs = OffsetsByLtc({}, videos);
  ASSERT_TRUE(syncs.ok()) << syncs.status();
  ASSERT_EQ(syncs->size(), 1u);
  EXPECT_NEAR((*syncs)[0].offset_s(), 36000 - 0.12, 0.001);
  EXPECT_GE((*syncs)[0].offset_sigma_s(), 1e-4);
  EXPECT_EQ((*syncs)[0].found_by(), "ltc");
  EXPECT_EQ(videos[0].timecode(), "09:59:59:22");  // three frames before
  EXPECT_EQ(videos[0].timecode_fps(), 25);
  EXPECT_TRUE(videos[0].is_timecode_fps_sure());
  EXPECT_NEAR(videos[0].timecode_at_s(), 0, 1e-9);
  // Where the sound begins later than the pictures, so does what is heard.
  videos = {*facts};
  videos[0].set_audio_start_s(1, 0.5);
  syncs = OffsetsByLtc({}, videos);
  ASSERT_TRUE(syncs.ok()) << syncs.status();
  EXPECT_NEAR((*syncs)[0].offset_s(), 36000 - 0.62, 0.001);
}

TEST(ImportVideos, PutsClipsInStepByTimecodeInTheirSound) {
  const TempFolder temp;
  // Its video frames begin 0.1 s before the timecode of its sound.
  MakeFilm(temp, "left", 10, 50, "10:00:00:00", 4800);
  MakeVideo(temp / "right.mkv", Values(15, 40), "25");
  WriteSound(temp / "b.raw", Sound("10:00:00:02", 25, 60, 0));
  Shell("ffmpeg -v error -f s16le -ar 48000 -ac 1 -i '" + (temp / "b.raw") + "' '" + (temp / "right.wav") +
        "'");
  VideoImportOptions options;
  options.videos = {{"left", temp / "left.mkv"}, {"right", temp / "right.mkv"}};
  options.sync = SyncWay::kLtc;
  const auto without = ImportVideos(options, temp / "take");
  EXPECT_THAT(std::string(without.status().message()), HasSubstr("right.mkv: has no linear timecode"));
  options.ltc = {{"right", temp / "right.wav"}};
  const auto result = ImportVideos(options, temp / "take");
  ASSERT_TRUE(result.ok()) << result.status();
  const v1::CameraSync &left = result->take.cameras(0).sync(), &right = result->take.cameras(1).sync();
  // Right's first frame is at 10:00:00:02, left's at 10:00:00:00 less 0.1 s: 4.5 frames apart.
  EXPECT_NEAR(right.offset_s() - left.offset_s(), 0.18, 0.001);
  EXPECT_EQ(left.found_by(), "ltc");
  EXPECT_LT(right.offset_sigma_s(), 0.001);
  EXPECT_EQ(right.timecode(), "10:00:00:02");
  EXPECT_EQ(result->take.timecode_fps(), 25);
}

TEST(ImportVideos, ListensBeforeItDecodes) {
  const TempFolder temp;
  MakeFilm(temp, "left", 10, 50, "10:00:00:00", 4800);
  MakeFilm(temp, "right", 15, 40, "10:00:00:02", 0);
  VideoImportOptions options;
  options.videos = {{"left", temp / "left.mkv"}, {"right", temp / "right.mkv"}};
  const auto result = ImportVideos(options, temp / "take");
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_NEAR(result->take.cameras(1).sync().offset_s() - result->take.cameras(0).sync().offset_s(), 0.18,
              0.001);
  EXPECT_EQ(result->take.sync(), "videos, offsets by ltc");
}

TEST(ImportVideos, SaysThatThereIsNoTimecodeInTheSoundEither) {
  const TempFolder temp;
  MakeFilm(temp, "left", 10, 50, "10:00:00:00", 0);
  Shell("ffmpeg -v error -f lavfi -i testsrc=d=1:r=25:s=64x48 -f lavfi -i sine=d=1 -c:v ffv1 -c:a flac '" +
        (temp / "right.mkv") + "'");
  VideoImportOptions options;
  options.videos = {{"left", temp / "left.mkv"}, {"right", temp / "right.mkv"}};
  const auto result = ImportVideos(options, temp / "take");
  EXPECT_THAT(
      std::string(result.status().message()),
      HasSubstr("no timecode in the videos of left, right, nor in their sound; name a rig and a board"));
}

}  // namespace
}  // namespace weft
