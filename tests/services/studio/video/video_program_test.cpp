#include "services/studio/video/video_program.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/capture/file_size_limit.h"
#include "tests/services/studio/video/made_video.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class VideoProgramTest : public ::testing::Test {
 protected:
  VideoProgramTest() {
    MakeVideo(temp_ / "a.mkv", Values(10, 4), "25");
    file_ = std::filesystem::canonical(temp_ / "a.mkv").string();
  }
  std::vector<std::string> Pixels() const {
    return {"-v", "error", "-i", "file:" + file_, "-f", "rawvideo", "-pix_fmt", "gray", "pipe:1"};
  }

  const TempFolder temp_;
  std::string file_;
};

TEST_F(VideoProgramTest, WhatItSaysIsKeptUntilItsEnd) {
  const auto said = RunVideoProgram(
      "ffprobe", file_,
      {"-v", "error", "-show_entries", "stream=width,height", "-of", "csv=p=0", "file:" + file_});
  ASSERT_TRUE(said.ok()) << said.status();
  EXPECT_EQ(said->out, "32,16\n");
  EXPECT_EQ(said->errors, "");
  EXPECT_EQ(said->wait_status, 0);
}

TEST_F(VideoProgramTest, ComplaintsAreKeptBesideIt) {
  const auto said = RunVideoProgram("ffprobe", file_, {"-v", "error", "file:" + file_ + ".none"});
  ASSERT_TRUE(said.ok()) << said.status();
  EXPECT_EQ(said->out, "");
  EXPECT_THAT(said->errors, HasSubstr("a.mkv.none"));
  EXPECT_NE(said->wait_status, 0);
}

TEST_F(VideoProgramTest, PixelsAreReadAsTheyCome) {
  auto program = VideoProgram::Start("ffmpeg", file_, Pixels(), VideoProgram::Out::kPipe);
  ASSERT_TRUE(program.ok()) << program.status();
  std::string picture(32 * 16, '\0');
  for (int value = 10; value < 14; ++value) {
    ASSERT_TRUE(program->Read(picture.data(), picture.size()).ok());
    EXPECT_EQ(picture, std::string(32 * 16, static_cast<char>(value)));
  }
  EXPECT_TRUE(absl::IsOutOfRange(program->Read(picture.data(), 1)));
  const auto said = program->Finish();
  ASSERT_TRUE(said.ok()) << said.status();
  EXPECT_EQ(said->wait_status, 0);
  EXPECT_EQ(said->out, "");
}

TEST_F(VideoProgramTest, IsStoppedWhereNobodyWantsMore) {
  // A second of work a picture: it is still at it when it is first looked at.
  const auto said = RunVideoProgram(
      "ffmpeg", file_,
      {"-v", "error", "-re", "-stream_loop", "-1", "-i", "file:" + file_, "-f", "null", "pipe:1"},
      [](size_t) { return false; });
  EXPECT_TRUE(absl::IsCancelled(said.status())) << said.status();
  EXPECT_THAT(std::string(said.status().message()), AllOf(HasSubstr("a.mkv"), HasSubstr("stopped")));
}

TEST_F(VideoProgramTest, WordsThatFilesMayNotHoldAreNoneThatWereSaid) {
  const std::vector<std::string> help = {"-hide_banner", "-h", "full"};
  const auto all = RunVideoProgram("ffmpeg", file_, help);
  ASSERT_TRUE(all.ok()) << all.status();
  ASSERT_GT(all->out.size(), 100'000u);
  const auto said = [&](size_t most) {
    const FileSizeLimit limit(most);
    return RunVideoProgram("ffmpeg", file_, help).status();
  };
  EXPECT_TRUE(said(all->out.size() + 1).ok());
  const absl::Status cut = said(20'000);
  EXPECT_TRUE(absl::IsResourceExhausted(cut)) << cut;
  EXPECT_THAT(std::string(cut.message()),
              AllOf(HasSubstr("a.mkv: ffmpeg says more of it than files may hold"), HasSubstr("ulimit -f")));
}

TEST_F(VideoProgramTest, AProgramThatIsNotThereSaysWhatToInstall) {
  const auto said = RunVideoProgram("ffmpeg-of-nobody", file_, {});
  ASSERT_TRUE(said.ok()) << said.status();
  EXPECT_NE(said->wait_status, 0);
  EXPECT_THAT(said->errors, HasSubstr("Usage: weft-video"));
}

TEST(LastComplaint, IsTheLastLineWithoutWhatStandsInBrackets) {
  EXPECT_EQ(LastComplaint(""), "");
  EXPECT_EQ(LastComplaint("first\nlast\n"), "last");
  EXPECT_EQ(LastComplaint("first\n  last  \n\n \n"), "last");
  EXPECT_EQ(LastComplaint("[h264 @ 0x55] [error] no frame!\n"), "no frame!");
  EXPECT_EQ(LastComplaint("no [such] thing\n"), "no [such] thing");
  EXPECT_EQ(LastComplaint("[cut"), "[cut");
}

}  // namespace
}  // namespace weft
