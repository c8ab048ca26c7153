// weft take export, trim.
#include <filesystem>
#include <memory>

#include "capture/image/image_file.h"
#include "capture/take/recorded_take.h"
#include "tests/services/tools/cli/small_take.h"
#include "weft/v1/replay.pb.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class CommandTakeCopy : public SmallTakeTest {
 protected:
  std::string Copied(const AloudRun& run) const {
    EXPECT_TRUE(run.status.ok()) << run.status;
    return TextOf(FromJson<v1::TakeCopy>(run.out));
  }
  const std::string out_ = folder_ / "out";
};

TEST_F(CommandTakeCopy, ExportWritesImages) {
  const AloudRun run = Take({"export", take_, "--out", out_});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.out, out_ + ": images of 4 frame sets\n");
  const auto image = ReadImageFile(out_ + "/0005/right.png");
  ASSERT_TRUE(image.ok()) << image.status();
  EXPECT_EQ(image->format, PixelFormat::kGrey8);
  EXPECT_FALSE(std::filesystem::exists(out_ + "/0006/right.png"));
  EXPECT_EQ(Copied(Take({"export", take_, "--out", folder_ / "again", "--json"})),
            "source: \"" + take_ + "\" out: \"" + (folder_ / "again") + "\" sets: 4");
}

TEST_F(CommandTakeCopy, ColoursComeOfAMosaicOnRequest) {
  const std::string mosaic = folder_ / "mosaic";
  PatternFrames cameras({"left"}, 64, 48, RawFormat::kBayerRg8);
  RecordPattern(mosaic, cameras);
  ASSERT_TRUE(Take({"export", mosaic, "--out", out_}).status.ok());
  EXPECT_EQ(BytesPerPixel(ReadImageFile(out_ + "/0005/left.png")->format), 1);
  ASSERT_TRUE(Take({"export", mosaic, "--out", folder_ / "colour", "--demosaic"}).status.ok());
  EXPECT_EQ(BytesPerPixel(ReadImageFile(folder_ / "colour/0005/left.png")->format), 3);
}

TEST_F(CommandTakeCopy, ExportWritesAnArchiveOrAVideo) {
  const AloudRun archive = Take({"export", take_, "--out", out_, "--format", "ffv1"});
  ASSERT_TRUE(archive.status.ok()) << archive.status;
  EXPECT_EQ(archive.out, out_ + ": 7 frames, each decoded again and equal to the take's in every byte\n");
  EXPECT_TRUE(std::filesystem::exists(out_ + "/left.mkv"));
  EXPECT_EQ(Copied(Take({"export", take_, "--out", folder_ / "again", "--format", "ffv1", "--json"})),
            "source: \"" + take_ + "\" out: \"" + (folder_ / "again") + "\" frames: 7");
  const std::string video = folder_ / "video.mkv";
  const AloudRun proxy =
      Take({"export", take_, "--out", video, "--format", "proxy", "--camera-width-px", "32"});
  ASSERT_TRUE(proxy.status.ok()) << proxy.status;
  EXPECT_EQ(proxy.out, video + ": a video of 4 frame sets\n");
  EXPECT_TRUE(std::filesystem::exists(video));
}

TEST_F(CommandTakeCopy, TrimKeepsARangeAndShiftsTimes) {
  const AloudRun run = Take({"trim", take_, "--frames", "6:8", "--shift", "left=2", "--out", out_});
  ASSERT_TRUE(run.status.ok()) << run.status;
  EXPECT_EQ(run.out, out_ + ": 2 frame sets\n");
  const auto cut = RecordedTake::Open(out_);
  ASSERT_TRUE(cut.ok()) << cut.status();
  EXPECT_THAT((*cut)->sets(), ElementsAre(6, 7));
  EXPECT_EQ((*cut)->ReadRaw(1, 0)->device_time_ns, 233'333'333 + 2'000'000);
  EXPECT_EQ((*cut)->ReadRaw(1, 1)->device_time_ns, 233'333'333);
  EXPECT_EQ(Copied(Take({"trim", take_, "--frames", "6", "--compress", "--out", folder_ / "one", "--json"})),
            "source: \"" + take_ + "\" out: \"" + (folder_ / "one") + "\" sets: 1");
}

TEST_F(CommandTakeCopy, TrimNeedsAPlaceAndARange) {
  EXPECT_EQ(Take({"trim", take_, "--frames", "6:8"}).status,
            absl::InvalidArgumentError("--out is required: the folder of the new take"));
  EXPECT_THAT(Take({"trim", take_, "--frames", "8:6", "--out", out_}).message(), HasSubstr("--frames 8:6"));
  EXPECT_EQ(Take({"trim", folder_ / "none", "--out", out_}).status.code(), absl::StatusCode::kNotFound);
  EXPECT_FALSE(std::filesystem::exists(out_));
}

// Grey that is the same everywhere takes a fraction of the room.
TEST_F(CommandTakeCopy, TrimCompressesOnRequest) {
  std::filesystem::create_directories(folder_ / "grey/0001");
  Frame grey;
  grey.width_px = 330, grey.height_px = 170, grey.format = PixelFormat::kGrey8;
  grey.pixels = std::make_shared<const std::vector<uint8_t>>(330 * 170, uint8_t{90});
  ASSERT_TRUE(WriteImageFile(folder_ / "grey/0001/left.png", grey).ok());
  TakeCopyOptions options;
  options.recorder = SmallRecorder();
  ASSERT_TRUE(ImportImages(folder_ / "grey", folder_ / "whole", options).ok());
  const auto bytes = [&](const std::string& out, std::vector<std::string> more) {
    more.insert(more.begin(), {"trim", folder_ / "whole", "--out", out});
    EXPECT_TRUE(Take(more).status.ok());
    return (*RecordedTake::Open(out))->Record(0, 0)->payload_bytes;
  };
  EXPECT_LT(bytes(folder_ / "small", {"--compress"}), bytes(out_, {}) / 4);
}

}  // namespace
}  // namespace weft
