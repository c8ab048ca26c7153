#include "services/tools/cli/confined_run.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <functional>
#include <string>

#include "services/ground/confinement/landlock.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

class ConfinedRun : public ::testing::Test {
 protected:
  ConfinedRun() {
    WriteBytes(folder_ / "avatar/space.bin", "x");
    WriteBytes(folder_ / "secret", "x");
    fs::create_symlink(folder_ / "avatar", folder_ / "link");
  }
  static bool Opens(const std::string& path, int flags = O_RDONLY) {
    return open(path.c_str(), flags | O_CLOEXEC, 0600) >= 0;
  }
  int Run(const ConfinedFiles& files, const std::function<int()>& run) {
    return RunConfinedProcess(files, run);
  }

  TempFolder folder_;
};

TEST_F(ConfinedRun, GivesTheExitStatus) {
  EXPECT_EQ(Run({}, [] { return 0; }), 0);
  EXPECT_EQ(Run({}, [] { return 2; }), 2);
}

TEST_F(ConfinedRun, ReadsItsInputsAndNothingElse) {
  if (LandlockVersion() == 0) GTEST_SKIP() << "this kernel has no Landlock";
  const std::string avatar = folder_ / "link", secret = folder_ / "secret", out = folder_ / "made/out";
  const int outcome = Run({.readable = {avatar}, .writable = {out}}, [&] {
    if (!Opens(avatar + "/space.bin")) return 10;
    if (Opens(secret)) return 11;
    if (Opens("/etc/passwd")) return 12;
    if (!Opens(out + "/file", O_WRONLY | O_CREAT)) return 13;
    if (Opens(avatar + "/new", O_WRONLY | O_CREAT)) return 14;
    if (chmod(secret.c_str(), 0666) == 0) return 15;
    return 0;
  });
  EXPECT_EQ(outcome, 0);
  EXPECT_TRUE(fs::exists(out + "/file"));
}

TEST_F(ConfinedRun, FoldersThatStayEmptyAreRemoved) {
  EXPECT_EQ(Run({.writable = {folder_ / "out"}}, [] { return 2; }), 2);
  EXPECT_FALSE(fs::exists(folder_ / "out"));
  fs::create_directories(folder_ / "kept");
  EXPECT_EQ(Run({.writable = {folder_ / "kept"}}, [] { return 2; }), 2);
  EXPECT_TRUE(fs::exists(folder_ / "kept"));
}

TEST_F(ConfinedRun, ACrashIsAFailure) {
  EXPECT_EQ(Run({},
                [] {
                  signal(SIGSEGV, SIG_DFL);
                  raise(SIGSEGV);
                  return 0;
                }),
            1);
}

TEST_F(ConfinedRun, SignalsOfOthersArriveInIt) {
  int ready[2];
  ASSERT_EQ(pipe(ready), 0);
  const pid_t outer = getpid();
  const pid_t sender = fork();
  if (sender == 0) {
    char told = 0;
    if (read(ready[0], &told, 1) == 1) kill(outer, SIGTERM);
    _exit(0);
  }
  EXPECT_EQ(Run({},
                [&ready] {
                  signal(SIGTERM, [](int) { _exit(7); });
                  if (write(ready[1], "x", 1) != 1) return 8;
                  for (;;) pause();
                  return 0;
                }),
            7);
  waitpid(sender, nullptr, 0);
  close(ready[0]);
  close(ready[1]);
}
TEST_F(ConfinedRun, SaysThatACrashMayBeMeant) {
  testing::internal::CaptureStderr();
  EXPECT_EQ(Run({},
                [] {
                  signal(SIGABRT, SIG_DFL);
                  raise(SIGABRT);
                  return 0;
                }),
            1);
  const std::string told = testing::internal::GetCapturedStderr();
  EXPECT_NE(
      told.find(
          "the process that read the inputs was ended: killed by signal 6 (Aborted); are they from somebody "
          "whom you trust?"),
      std::string::npos)
      << told;
}

// Else a shell would go on with the next command.
TEST_F(ConfinedRun, ASignalThatEndsItEndsTheCommand) {
  for (const int by : {SIGINT, SIGTERM, SIGHUP}) {
    const auto run = [&] {
      Run({}, [by] {
        signal(by, SIG_DFL);
        raise(by);
        return 0;
      });
    };
    EXPECT_EXIT(run(), testing::KilledBySignal(by), "");
  }
}

// Nobody would end what strangers made it do.
TEST_F(ConfinedRun, EndsWithTheCommandHoweverThatEnds) {
  int pipe_of[2];
  ASSERT_EQ(pipe(pipe_of), 0);
  const pid_t command = fork();
  if (command == 0) {
    Run({}, [&pipe_of] {
      const pid_t self = getpid();
      if (write(pipe_of[1], &self, sizeof self) != sizeof self) return 1;
      for (;;) pause();
      return 0;
    });
    _exit(0);
  }
  close(pipe_of[1]);
  pid_t confined = 0;
  ASSERT_EQ(read(pipe_of[0], &confined, sizeof confined), static_cast<ssize_t>(sizeof confined));
  kill(command, SIGKILL);
  waitpid(command, nullptr, 0);
  pollfd end = {.fd = pipe_of[0], .events = POLLIN, .revents = 0};  // both have to be gone for it
  EXPECT_EQ(poll(&end, 1, 20'000), 1);
  if (end.revents == 0) kill(confined, SIGKILL);
  close(pipe_of[0]);
}

TEST_F(ConfinedRun, SignalsAreBlockedOnlyWhileItRuns) {
  sigset_t before, within, after;
  sigprocmask(SIG_SETMASK, nullptr, &before);
  EXPECT_EQ(Run({},
                [&] {
                  sigprocmask(SIG_SETMASK, nullptr, &within);
                  return sigismember(&within, SIGTERM) + sigismember(&within, SIGCHLD);
                }),
            0);
  sigprocmask(SIG_SETMASK, nullptr, &after);
  for (const int signal : {SIGCHLD, SIGINT, SIGTERM, SIGHUP})
    EXPECT_EQ(sigismember(&after, signal), sigismember(&before, signal)) << signal;
}

TEST_F(ConfinedRun, PathsThatAreNotGivenAreNone) {
  EXPECT_EQ(Run({.readable = {"", folder_ / "none"}, .writable = {""}}, [] { return 0; }), 0);
  WriteBytes(folder_ / "file", "x");
  testing::internal::CaptureStderr();
  EXPECT_NE(Run({.writable = {folder_ / "file/out"}}, [] { return 0; }), 0);
  EXPECT_NE(testing::internal::GetCapturedStderr().find(folder_ / "file"), std::string::npos);
}

TEST_F(ConfinedRun, RunsProgramsOnlyWhereItMay) {
  if (LandlockVersion() == 0) GTEST_SKIP() << "this kernel has no Landlock";
  const auto run_one = [] {
    char name[] = "true";
    char* const arguments[] = {name, nullptr};
    execv("/bin/true", arguments);
    return 9;  // it could not
  };
  EXPECT_EQ(Run({.may_run_programs = true}, run_one), 0);
  EXPECT_NE(Run({}, run_one), 0);
}

TEST_F(ConfinedRun, WhatIsPrintedArrives) {
  testing::internal::CaptureStdout();
  std::printf("before ");
  EXPECT_EQ(Run({},
                [] {
                  std::printf("within ");
                  return 0;
                }),
            0);
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "before within ");
}

}  // namespace
}  // namespace weft
