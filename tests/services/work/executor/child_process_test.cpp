#include "services/work/executor/child_process.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>

#include "services/ground/process/exit_status.h"

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

}  // namespace
}  // namespace weft
