#include "services/work/executor/run_program.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;

// By the shell.
absl::StatusOr<std::string> RunScript(const std::string& script, ProgramRun run = {}) {
  run.arguments = {"-c", script};
  return RunProgram("/bin/sh", run);
}

TEST(RunProgram, GivesWhatItPrintedOnItsOutput) {
  EXPECT_EQ(*RunScript("echo one; echo two >&2; echo three"), "one\nthree\n");
  EXPECT_EQ(*RunScript(":"), "");
}

TEST(RunProgram, ReadsItsInputFromAFile) {
  const TempFolder folder;
  WriteBytes(folder / "input", "some words");
  ProgramRun run;
  run.input = folder / "input";
  EXPECT_EQ(*RunScript("cat", run), "some words");
  EXPECT_EQ(*RunScript("cat"), "");
}

TEST(RunProgram, OutputBeyondTheLimitIsDropped) {
  ProgramRun run;
  run.most_bytes = 4;
  EXPECT_EQ(*RunScript("printf 123456", run), "1234");
  // Of what went wrong the end is kept.
  EXPECT_THAT(std::string(RunScript("printf abcdef >&2; exit 1", run).status().message()),
              EndsWith("; it printed: cdef"));
}

TEST(RunProgram, AnotherStatusIsAnErrorWithItsLastWords) {
  const absl::Status status = RunScript("echo out; echo ' bad ' >&2; exit 3").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInternal);
  EXPECT_EQ(status.message(), "/bin/sh: exit status 3; it printed: out\n bad");
  EXPECT_EQ(RunScript("exit 4").status().message(), "/bin/sh: exit status 4");
  EXPECT_THAT(std::string(RunScript("kill -9 $$").status().message()), HasSubstr("killed by signal 9"));
  const std::string words(RunScript("printf '%0600d' 7; exit 1").status().message());
  EXPECT_EQ(words.size(), std::string("/bin/sh: exit status 1; it printed: ").size() + 500);
  EXPECT_THAT(words, EndsWith("0007"));
}

TEST(RunProgram, EndsWhatTakesTooLong) {
  ProgramRun run;
  run.patience = std::chrono::milliseconds(250);
  const auto began = std::chrono::steady_clock::now();
  const absl::Status status = RunScript("echo begun; sleep 60", run).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDeadlineExceeded);
  EXPECT_EQ(status.message(), "/bin/sh: took more than 0.25 s and was ended; it printed: begun");
  EXPECT_GE(std::chrono::steady_clock::now() - began, std::chrono::milliseconds(250));
  EXPECT_LT(std::chrono::steady_clock::now() - began, std::chrono::seconds(30));
}

TEST(RunProgram, StopsWhenAskedTo) {
  std::stop_source stop;
  ProgramRun run;
  run.stop = stop.get_token();
  std::jthread later([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    stop.request_stop();
  });
  EXPECT_EQ(RunScript("sleep 60", run).status(), absl::CancelledError("/bin/sh: was to stop"));
}

TEST(RunProgram, HidesSecretsWhereThatIsAskedFor) {
  setenv("STUDIO_SECRET_TOKEN", "weft_0a1b", 1);
  ProgramRun run;
  EXPECT_EQ(*RunScript("printf \"$STUDIO_SECRET_TOKEN\"", run), "weft_0a1b");
  run.hides_secrets = true;
  EXPECT_EQ(*RunScript("printf \"$STUDIO_SECRET_TOKEN\"", run), "");
  unsetenv("STUDIO_SECRET_TOKEN");
}

TEST(RunProgram, NamesAProgramThatIsNotThere) {
  const absl::Status status = RunProgram("/no/such/program", {}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(status.message()),
              AllOf(HasSubstr("/no/such/program"), HasSubstr("cannot be started")));
}

}  // namespace
}  // namespace weft
