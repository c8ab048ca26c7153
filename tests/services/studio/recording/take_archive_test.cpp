#include "services/studio/recording/take_archive.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "services/formats/files/atomic_file.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/studio/recording/recorded_pattern.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

// What the program ffmpeg makes of a video, all frames behind each other.
std::string Decoded(const std::string& video, const std::string& pixels) {
  const std::string raw = video + ".raw";
  const std::string command = "ffmpeg -v error -i '" + video +
                              "' -fps_mode passthrough -f rawvideo -pix_fmt " + pixels + " '" + raw + "'";
  EXPECT_EQ(std::system(command.c_str()), 0);
  return *ReadWholeFile(raw);
}

TEST(TakeArchive, GivesBackEveryByte) {
  struct Case {
    RawFormat format;
    const char* pixels;
  };
  for (const Case& c :
       {Case{RawFormat::kBayerRg8, "gray"}, Case{RawFormat::kMono12, "gray16le"},
        Case{RawFormat::kMono10p, "gray"}, Case{RawFormat::kRgb8, "rgb24"}, Case{RawFormat::kYuyv, "gray"}}) {
    const TempFolder temp;
    PatternFrames cameras({"right"}, 64, 48, c.format);
    RecordPattern(temp / "take", cameras);
    uint64_t last = 0;
    const auto frames = ExportArchive(temp / "take", temp / "archive", [&](uint64_t done, uint64_t total) {
      EXPECT_EQ(done, ++last);
      EXPECT_EQ(total, 6u);
    });
    ASSERT_TRUE(frames.ok()) << RawFormatName(c.format) << ": " << frames.status();
    EXPECT_EQ(*frames, 3u);
    EXPECT_EQ(last, 6u);
    std::string expected;
    for (const uint64_t number : {5, 7, 8}) {
      const RawFrame frame = cameras.Frame(0, number);
      expected.append(reinterpret_cast<const char*>(frame.bytes->data()), frame.bytes->size());
    }
    EXPECT_TRUE(Decoded(temp / "archive" + "/right.mkv", c.pixels) == expected) << RawFormatName(c.format);
    EXPECT_THAT(*ReadWholeFile(temp / "archive" + "/right.csv"),
                AllOf(HasSubstr("\n1,7,"), HasSubstr(RawFormatName(c.format))));
    EXPECT_THAT(*ReadWholeFile(temp / "archive" + "/ledger.csv"), HasSubstr("3 packets lost"));
  }
}

TEST(TakeArchive, RefusesWhatIsCompressedAlready) {
  const TempFolder temp;
  PatternFrames cameras({"left"}, 64, 48, RawFormat::kMono8);
  RawFrameSet set = cameras.Set(1);
  set.frames[0].format = RawFormat::kMotionJpeg;
  RecordSets(temp / "take", {"left"}, {set});
  EXPECT_THAT(std::string(ExportArchive(temp / "take", temp / "archive").status().message()),
              HasSubstr("camera left: motion JPEG"));
  EXPECT_FALSE(ReadWholeFile(temp / "archive" + "/take.json").ok());
  EXPECT_TRUE(absl::IsNotFound(ExportArchive(temp / "nothing", temp / "archive").status()));
}

// A video has one size.
TEST(TakeArchive, FramesThatChangeTheirSizeAreNamed) {
  const TempFolder temp;
  PatternFrames cameras({"left"}, 64, 48, RawFormat::kMono8), smaller({"left"}, 32, 48, RawFormat::kMono8);
  RecordSets(temp / "take", {"left"}, {cameras.Set(1), cameras.Set(2), smaller.Set(3)});
  const absl::Status status = ExportArchive(temp / "take", temp / "archive").status();
  EXPECT_TRUE(absl::IsInvalidArgument(status));
  EXPECT_EQ(status.message(),
            "camera left: its frames change size or format at set 3; export the parts (`weft take trim`)");
  EXPECT_FALSE(ReadWholeFile(temp / "archive" + "/take.json").ok());
}

}  // namespace
}  // namespace weft
