#include "services/tools/cli/confined_run.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

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
  const pid_t outer = getpid();
  const pid_t sender = fork();
  if (sender == 0) {
    usleep(300'000);
    kill(outer, SIGTERM);
    _exit(0);
  }
  EXPECT_EQ(Run({},
                [] {
                  signal(SIGTERM, [](int) { _exit(7); });
                  for (;;) pause();
                  return 0;
                }),
            7);
}

}  // namespace
}  // namespace weft
