// weft take import.
#include <filesystem>
#include <memory>

#include "capture/image/image_file.h"
#include "capture/take/recorded_take.h"
#include "tests/services/studio/video/made_video.h"
#include "tests/services/tools/cli/small_take.h"
#include "weft/v1/replay.pb.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class CommandTakeImport : public ::testing::Test {
 protected:
  CommandTakeImport() { unsetenv("WEFT_SERVER"); }
  AloudRun Import(std::vector<std::string> words) const {
    words.insert(words.begin(), "import");
    words.insert(words.end(), {"--out", out_});
    return RunAloud(AddTakeImportCommand, std::move(words));
  }
  // Pictures of the camera left, by these names.
  std::string Pictures(const std::vector<std::string>& names) const {
    PatternFrames cameras({"left"}, 33, 17, RawFormat::kMono8);
    const auto image = ToFrame(cameras.Frame(0, 1));
    for (const std::string& name : names) {
      std::filesystem::create_directories(folder_ / ("images/" + name));
      EXPECT_TRUE(image.ok() && WriteImageFile(folder_ / ("images/" + name + "/left.png"), *image).ok());
    }
    return folder_ / "images";
  }
  std::vector<std::string> Videos() const {
    MakeVideo(folder_ / "left.mkv", Values(10, 8), "25", "-c:v ffv1 -timecode 10:00:00:23");
    MakeVideo(folder_ / "right.mkv", Values(13, 7), "25", "-c:v ffv1 -timecode 10:00:01:01");
    return {folder_ / "left.mkv", folder_ / "right.mkv"};
  }
  std::vector<int64_t> Times_ns() const {
    const auto take = RecordedTake::Open(out_);
    EXPECT_TRUE(take.ok()) << take.status();
    std::vector<int64_t> times;
    for (size_t set = 0; take.ok() && set < (*take)->sets().size(); ++set)
      times.push_back((*take)->ReadRaw(set, 0)->device_time_ns);
    return times;
  }
  std::string WhyNot(const std::vector<std::string>& words) const {
    const AloudRun run = Import(words);
    EXPECT_EQ(run.status.code(), absl::StatusCode::kInvalidArgument) << run.status;
    EXPECT_FALSE(std::filesystem::exists(out_));
    return run.message();
  }

  const TempFolder folder_;
  const std::string out_ = folder_ / "take";
};

TEST_F(CommandTakeImport, ImagesGetTimesByTheirRate) {
  const AloudRun run = Import({Pictures({"0007", "0009"}), "--fps", "100"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.out, out_ + ": 2 frame sets\n");
  EXPECT_THAT(Times_ns(), ElementsAre(70'000'000, 90'000'000));
  EXPECT_EQ((*RecordedTake::Open(out_))->ReadRaw(0, 0)->format, RawFormat::kMono8);
}

TEST_F(CommandTakeImport, NamesMayBeTimesAndGreyAMosaic) {
  const AloudRun run =
      Import({Pictures({"1000", "1040"}), "--names", "ms", "--mosaic", "bayer_gb8", "--compress", "--json"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  const auto copy = FromJson<v1::TakeCopy>(run.out);
  EXPECT_EQ(copy.source(), folder_ / "images");
  EXPECT_EQ(copy.out(), out_);
  EXPECT_EQ(copy.sets(), 2u);
  const std::vector<int64_t> times = Times_ns();
  ASSERT_EQ(times.size(), 2u);
  EXPECT_EQ(times[1] - times[0], 40'000'000);
  EXPECT_EQ((*RecordedTake::Open(out_))->ReadRaw(0, 0)->format, RawFormat::kBayerGb8);
}

// As what names were taken is said where nobody said it.
TEST_F(CommandTakeImport, WhatNamesWereTakenAsIsSaid) {
  const AloudRun run = Import({Pictures({"1623840123456789012", "1623840123490122345"})});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.out, out_ + ": 2 frame sets\n");
  EXPECT_THAT(run.err, testing::StartsWith("weft: warning: "));
}

TEST_F(CommandTakeImport, VideosComeInStepByTimecode) {
  std::vector<std::string> words = Videos();
  words.insert(words.end(), {"--slate", "12A", "--name", "walk", "--notes", "wet"});
  const AloudRun run = Import(words);
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_THAT(run.out, testing::StartsWith(out_ + ": 10 frame sets of 2 cameras, "));
  EXPECT_THAT(run.out, HasSubstr("\ntimecode of the first: 10:00:00:23\ncamera  video"));
  EXPECT_THAT(
      run.out,
      HasSubstr(
          "\nright   video:right.mkv        7     40.000     120.000    11.547  timecode    10:00:01:01\n"));
  EXPECT_THAT(run.err, HasSubstr("weft: warning: "));
  const auto file = ReadTakeFileStrictly(out_);
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->take.slate() + "|" + file->take.name() + "|" + file->take.notes(), "12A|walk|wet");
}

TEST_F(CommandTakeImport, VideosMayBeNamedAndMovedByHand) {
  const std::vector<std::string> videos = Videos();
  const AloudRun run = Import({"--camera", "a=" + videos[0], "--camera", "b=" + videos[1], "--offset",
                               "b=0.04", "--sync", "together", "--json"});
  ASSERT_TRUE(run.status.ok()) << run.status;
  const auto copy = FromJson<v1::TakeCopy>(run.out);
  EXPECT_EQ(copy.source(), "a=" + videos[0]);
  ASSERT_EQ(copy.take().cameras_size(), 2);
  EXPECT_EQ(copy.take().cameras(0).id(), "a");
  EXPECT_NEAR(copy.take().cameras(1).sync().offset_s() - copy.take().cameras(0).sync().offset_s(), 0.04,
              1e-9);
  EXPECT_EQ(copy.sets(), copy.take().sets_recorded());
  EXPECT_GE(copy.warnings_size(), 1);
}

TEST_F(CommandTakeImport, OptionsOfImagesAndOfVideosAreToldApart) {
  const std::string images = Pictures({"0007"});
  WriteBytes(folder_ / "left.mkv", "no video");
  const std::string video = folder_ / "left.mkv";
  for (const std::vector<std::string>& more : std::vector<std::vector<std::string>>{
           {"--rig", "r"}, {"--board", "b"}, {"--sync", "motion"}, {"--offset", "left=1"}}) {
    std::vector<std::string> words = {images};
    words.insert(words.end(), more.begin(), more.end());
    EXPECT_EQ(WhyNot(words),
              images + ": a folder of images; --rig, --board, --sync and --offset are for videos");
  }
  EXPECT_EQ(WhyNot({video, "--fps", "30"}), "--fps and --names are for images; videos say their times");
  EXPECT_EQ(WhyNot({video, "--names", "ms"}), "--fps and --names are for images; videos say their times");
  EXPECT_THAT(WhyNot({images, "--names", "weeks"}), HasSubstr("--names"));
  EXPECT_THAT(WhyNot({images, "--mosaic", "rgb"}), HasSubstr("rgb"));
  EXPECT_THAT(WhyNot({video, "--sync", "hope"}), HasSubstr("--sync"));
  EXPECT_THAT(WhyNot({video, "--mosaic", "rgb"}), HasSubstr("rgb"));
  EXPECT_THAT(WhyNot({}), HasSubstr("SOURCE, or --camera NAME=FILE"));
}

TEST_F(CommandTakeImport, WhatIsGivenOfACameraNamesIt) {
  for (const char* text : {"left", "=1", "left="}) {
    const std::string given = text;
    EXPECT_EQ(WhyNot({"--camera", given}), "--camera " + given + ": must be NAME=...");
    EXPECT_EQ(WhyNot({"x.mkv", "y.mkv", "--ltc", given}), "--ltc " + given + ": must be NAME=...");
    EXPECT_EQ(WhyNot({"x.mkv", "y.mkv", "--offset", given}), "--offset " + given + ": must be NAME=...");
  }
  EXPECT_EQ(WhyNot({"x.mkv", "y.mkv", "--offset", "x=soon"}), "--offset x=soon: seconds are wanted");
}

// Grey that is the same everywhere takes a fraction of the room.
TEST_F(CommandTakeImport, StreamsAreCompressedOnRequest) {
  const std::string images = folder_ / "images/0001";
  std::filesystem::create_directories(images);
  Frame grey;
  grey.width_px = 330, grey.height_px = 170, grey.format = PixelFormat::kGrey8;
  grey.pixels = std::make_shared<const std::vector<uint8_t>>(330 * 170, uint8_t{90});
  ASSERT_TRUE(WriteImageFile(images + "/left.png", grey).ok());
  const auto bytes = [&](const std::string& out, std::vector<std::string> more) {
    more.insert(more.begin(), {"import", folder_ / "images", "--out", out});
    EXPECT_TRUE(RunAloud(AddTakeImportCommand, more).status.ok());
    return (*RecordedTake::Open(out))->Record(0, 0)->payload_bytes;
  };
  EXPECT_LT(bytes(folder_ / "small", {"--compress"}), bytes(out_, {}) / 4);
}

}  // namespace
}  // namespace weft
