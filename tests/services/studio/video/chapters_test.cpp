#include "services/studio/video/chapters.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(ChapterOf, KnowsNamesOfBothKinds) {
  EXPECT_EQ(ChapterOf("GX010042.MP4")->recording, ChapterOf("gx120042.mp4")->recording);
  EXPECT_EQ(ChapterOf("GX120042.MP4")->number, 12);
  EXPECT_EQ(ChapterOf("GOPR0042.MP4")->recording, ChapterOf("GP010042.MP4")->recording);
  EXPECT_LT(ChapterOf("GOPR0042.MP4")->number, ChapterOf("GP010042.MP4")->number);
  for (const char* other : {"GH010042.MP4", "GX010043.MP4", "GP010042.MP4", "GX010042.MOV"})
    EXPECT_NE(ChapterOf("GX010042.MP4")->recording, ChapterOf(other)->recording) << other;
  for (const char* none : {"a.mp4", "GX01.mkv", "GXAA0042.MP4", "MVI_0042.MP4", "GX01004x.MP4", ""})
    EXPECT_FALSE(ChapterOf(none)) << none;
}

TEST(ChaptersAfter, AreThoseOfTheSameRecording) {
  const TempFolder temp;
  for (const char* name :
       {"GX010042.MP4", "GX030042.MP4", "GX020042.MP4", "GX020043.MP4", "GH020042.MP4", "a.mp4"})
    WriteBytes(temp / name, "");
  EXPECT_THAT(ChaptersAfter(temp / "GX010042.MP4"), ElementsAre("GX020042.MP4", "GX030042.MP4"));
  EXPECT_THAT(ChaptersAfter(temp / "GX030042.MP4"), IsEmpty());
  EXPECT_THAT(ChaptersAfter(temp / "a.mp4"), IsEmpty());
}

TEST(CheckChapters, AreNoCamerasOfTheirOwn) {
  EXPECT_TRUE(CheckChapters({"a/GX010042.MP4", "b/GX020042.MP4", "a/GX010043.MP4", "a/GH010042.MP4"}).ok());
  const absl::Status status = CheckChapters({"a/GX010042.MP4", "a/GX020042.MP4"});
  EXPECT_TRUE(absl::IsInvalidArgument(status));
  EXPECT_THAT(std::string(status.message()), ::testing::HasSubstr("the same recording as a/GX010042.MP4"));
}

TEST(ChaptersText, NamesWhatIsNotInTheTake) {
  const TempFolder temp;
  for (const char* name : {"GOPR0042.MP4", "GP010042.MP4"}) WriteBytes(temp / name, "");
  EXPECT_THAT(ChaptersText(temp / "GOPR0042.MP4"),
              ::testing::HasSubstr("goes on in GP010042.MP4, which is not in"));
  EXPECT_EQ(ChaptersText(temp / "GP010042.MP4"), "");
}

}  // namespace
}  // namespace weft
