#include "services/work/executor/child_process.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include "services/ground/process/exit_status.h"
#include "services/work/executor/process_record.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::ElementsAre;

TEST(LineSplitter, JoinsPiecesAndKeepsTheRest) {
  LineSplitter lines;
  EXPECT_THAT(lines.Add("ab"), ElementsAre());
  EXPECT_THAT(lines.Add("c\n\nd"), ElementsAre("abc", ""));
  EXPECT_EQ(lines.TakeRest(), "d");
  EXPECT_EQ(lines.TakeRest(), "");
}

TEST(LineSplitter, CutsEndlessLines) {
  LineSplitter lines;
  const std::string piece(LineSplitter::kMaxLineBytes / 2 + 10, 'x');
  for (int i = 0; i < 5; ++i) EXPECT_THAT(lines.Add(piece), ElementsAre());
  const std::vector<std::string> done = lines.Add("tail\nnext\n");
  ASSERT_EQ(done.size(), 2u);
  EXPECT_EQ(done[0].size(), LineSplitter::kMaxLineBytes);
  EXPECT_EQ(done[1], "next");
}

struct Ended {
  std::string out, err;
  int status = 0;
};

Ended RunToEnd(const std::string& script, const ChildSettings& settings = {}) {
  absl::StatusOr<ChildProcess> child = ChildProcess::Spawn("/bin/sh", {"-c", script}, settings);
  EXPECT_TRUE(child.ok()) << child.status();
  pollfd exited = {child->exit_fd(), POLLIN, 0};
  poll(&exited, 1, 20'000);
  Ended ended;
  ended.out = child->ReadOut();
  ended.err = child->ReadErr();
  ended.status = child->Reap();
  return ended;
}

TEST(ChildProcess, ReadsBothStreamsAndTheExitStatus) {
  const Ended ended = RunToEnd("echo one; echo two >&2; exit 3");
  EXPECT_EQ(ended.out, "one\n");
  EXPECT_EQ(ended.err, "two\n");
  EXPECT_EQ(DescribeExit(ended.status), "exit status 3");
}

TEST(ChildProcess, DescribesASignal) {
  const Ended ended = RunToEnd("kill -SEGV $$");
  EXPECT_EQ(DescribeExit(ended.status), "killed by signal 11 (Segmentation fault)");
}

TEST(ChildProcess, SeesNoOtherDescriptorsAndAnEmptyInput) {
  // The fourth is the directory itself, which ls holds open while it reads it.
  EXPECT_EQ(RunToEnd("ls /proc/self/fd; cat").out, "0\n1\n2\n3\n");
}

TEST(ChildProcess, SeesNoSecretsOfTheEnvironment) {
  setenv("STUDIO_TOKEN", "weft_0a1b", 1);
  setenv("STUDIO_NAME", "attic", 1);
  const std::string script = "echo $STUDIO_TOKEN$STUDIO_NAME";
  EXPECT_EQ(RunToEnd(script, {.hides_secrets = true}).out, "attic\n");
  // A studio's own commands need theirs.
  EXPECT_EQ(RunToEnd(script).out, "weft_0a1battic\n");
}

TEST(ChildProcess, NamesAProgramThatDoesNotExist) {
  const auto child = ChildProcess::Spawn("/no/such/program", {});
  EXPECT_EQ(child.status().code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(child.status().message()), ::testing::HasSubstr("/no/such/program"));
}

TEST(LineSplitter, CutsALineAtItsLimitAndKeepsOneOfThatLength) {
  LineSplitter lines;
  const std::string longest(LineSplitter::kMaxLineBytes, 'x');
  EXPECT_THAT(lines.Add(longest + "\n"), ElementsAre(longest));
  EXPECT_THAT(lines.Add(longest + "y\nnext\n"), ElementsAre(longest, "next"));
  EXPECT_THAT(lines.Add(longest + "y"), ElementsAre());
  EXPECT_EQ(lines.TakeRest(), longest);
  EXPECT_THAT(lines.Add("after\n"), ElementsAre("after"));
}

TEST(ChildProcess, StartsInItsFolderWithItsInput) {
  const TempFolder folder;
  WriteBytes(folder / "words", "some words");
  EXPECT_EQ(RunToEnd("pwd; cat", {.folder = folder.path(), .input = folder / "words"}).out,
            folder.path() + "\nsome words");
}

TEST(ChildProcess, IsRecordedUntilItIsReaped) {
  const TempFolder folder;
  absl::StatusOr<ChildProcess> child =
      ChildProcess::Spawn("/bin/sh", {"-c", "sleep 60"}, {.record_folder = folder / "processes"});
  ASSERT_TRUE(child.ok()) << child.status();
  EXPECT_THAT(FindRecorded(folder / "processes"), ElementsAre(child->pid()));
  child->Signal(SIGTERM);
  EXPECT_EQ(DescribeExit(child->Reap()).substr(0, 16), "killed by signal");
  EXPECT_TRUE(std::filesystem::is_empty(folder / "processes"));
  EXPECT_LT(child->pid(), 0);
}

// The shell's own child is of the same group.
TEST(ChildProcess, EndsWhatItStartedToo) {
  pid_t grandchild = 0;
  {
    absl::StatusOr<ChildProcess> child = ChildProcess::Spawn("/bin/sh", {"-c", "sleep 60 & echo $!; wait"});
    ASSERT_TRUE(child.ok()) << child.status();
    pollfd readable = {child->out_fd(), POLLIN, 0};
    ASSERT_EQ(poll(&readable, 1, 20'000), 1);
    grandchild = std::stoi(child->ReadOut());
    EXPECT_EQ(kill(grandchild, 0), 0);
    const ChildProcess moved = *std::move(child);  // what is left behind owns nothing
  }
  // Whoever adopts it reaps it a moment later; until then it is a zombie.
  const std::string status = "/proc/" + std::to_string(grandchild) + "/stat";
  const auto runs = [&] {
    const std::string line = ReadBytes(status);
    return !line.empty() && line.find(") Z") == std::string::npos && line.find(") X") == std::string::npos;
  };
  for (int k = 0; k < 200 && runs(); ++k) usleep(10'000);
  EXPECT_FALSE(runs());
}

TEST(ChildProcess, NoPermissionIsToldFromNoProgram) {
  const TempFolder folder;
  WriteBytes(folder / "text", "no program");
  EXPECT_EQ(ChildProcess::Spawn(folder / "text", {}).status().code(), absl::StatusCode::kPermissionDenied);
  EXPECT_EQ(ChildProcess::Spawn(folder / "text/more", {}).status().code(), absl::StatusCode::kNotFound);
  std::filesystem::permissions(folder / "text", std::filesystem::perms::owner_all);
  EXPECT_EQ(ChildProcess::Spawn(folder / "text", {}).status().code(), absl::StatusCode::kPermissionDenied)
      << "of no format that runs";
}

}  // namespace
}  // namespace weft
