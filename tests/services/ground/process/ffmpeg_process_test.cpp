// A program of the name ffmpeg at the other end of a pipe.
#include "services/ground/process/ffmpeg_process.h"

#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/stat.h>

#include "absl/strings/str_cat.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

// A script of that name is the first one in PATH.
class FfmpegProcessTest : public ::testing::Test {
 protected:
  ~FfmpegProcessTest() override { setenv("PATH", path_.c_str(), 1); }

  absl::StatusOr<FfmpegProcess> Start(const std::string& script,
                                      const std::vector<std::string>& arguments = {}) {
    WriteBytes(folder_ / "ffmpeg", "#!/bin/sh\n" + script);
    EXPECT_EQ(chmod((folder_ / "ffmpeg").c_str(), 0700), 0);
    setenv("PATH", absl::StrCat(folder_.path(), ":", path_).c_str(), 1);
    return FfmpegProcess::Start(arguments);
  }
  static std::string Read(FfmpegProcess& process, size_t size) {
    std::string text(size, ' ');
    const absl::Status status = process.Read(text.data(), size);
    return status.ok() ? text : status.ToString();
  }

  const TempFolder folder_;
  const std::string path_ = getenv("PATH");
};

TEST(FfmpegArguments, AreAsItsManualSays) {
  EXPECT_EQ(VideoRate(0), "30");
  EXPECT_EQ(VideoRate(1), "1000000000/1");
  EXPECT_EQ(VideoRate(33'366'700), "1000000000/33366700");
  EXPECT_EQ(FileArgument("-a:b.mp4"), "file:-a:b.mp4");
}

TEST_F(FfmpegProcessTest, IsQuietAndAsksNothing) {
  const std::string words = "-hide_banner -loglevel error -nostdin -y -i a b ";
  absl::StatusOr<FfmpegProcess> process = Start("printf '%s ' \"$@\"\n", {"-i", "a b"});
  ASSERT_TRUE(process.ok()) << process.status();
  EXPECT_EQ(Read(*process, words.size()), words);
  EXPECT_TRUE(process->Finish().ok());
}

TEST_F(FfmpegProcessTest, TalksBothWays) {
  absl::StatusOr<FfmpegProcess> process = Start("read word; echo got $word; read word; echo and $word\n");
  ASSERT_TRUE(process.ok()) << process.status();
  EXPECT_TRUE(process->Write("one\n", 4).ok());
  EXPECT_EQ(Read(*process, 8), "got one\n");
  EXPECT_TRUE(process->Write("two\nmore", 4).ok());
  EXPECT_EQ(Read(*process, 8), "and two\n");
  EXPECT_TRUE(process->Finish().ok());
}

TEST_F(FfmpegProcessTest, ALargeFrameArrivesWhole) {
  absl::StatusOr<FfmpegProcess> process = Start("head -c 3000000 | wc -c; exit 0\n");
  ASSERT_TRUE(process.ok()) << process.status();
  const std::string frame(3'000'000, 'f');
  EXPECT_TRUE(process->Write(frame.data(), frame.size()).ok());
  EXPECT_EQ(Read(*process, 8), "3000000\n");
}

TEST_F(FfmpegProcessTest, FailsWithItsLastWords) {
  absl::StatusOr<FfmpegProcess> process = Start("echo ' no such codec ' >&2; exit 3\n");
  ASSERT_TRUE(process.ok()) << process.status();
  EXPECT_EQ(Read(*process, 1), "OUT_OF_RANGE: ffmpeg has no more: no such codec");
  const std::string word(100, 'w');
  absl::Status ended;
  while (ended.ok()) ended = process->Write(word.data(), word.size());
  EXPECT_EQ(ended, absl::InternalError("ffmpeg ended early: no such codec"));
  EXPECT_EQ(process->Finish(), absl::InternalError("ffmpeg failed: no such codec"));
}

TEST_F(FfmpegProcessTest, ShowsTheEndOfManyWords) {
  absl::StatusOr<FfmpegProcess> process = Start("printf '%02000d%0100d' 1 2 >&2; kill -9 $$\n");
  ASSERT_TRUE(process.ok()) << process.status();
  EXPECT_EQ(process->Finish(), absl::InternalError("ffmpeg failed: " + std::string(1899, '0') + "1" +
                                                   std::string(99, '0') + "2"));
}

TEST_F(FfmpegProcessTest, IsEndedWhateverItHasToSay) {
  absl::StatusOr<FfmpegProcess> process = Start("trap '' PIPE; while echo more; do :; done; exit 0\n");
  ASSERT_TRUE(process.ok()) << process.status();
  EXPECT_EQ(Read(*process, 5), "more\n");
  EXPECT_TRUE(process->Finish().ok());
}

TEST_F(FfmpegProcessTest, IsNamedWhereItIsMissing) {
  setenv("PATH", folder_.path().c_str(), 1);
  EXPECT_EQ(FfmpegProcess::Start({}).status(),
            absl::NotFoundError("the program ffmpeg does not start: No such file or directory; install the "
                                "package ffmpeg"));
}

}  // namespace
}  // namespace weft
