#include "services/formats/files/holder_record.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <functional>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class HolderRecordTest : public ::testing::Test {
 protected:
  const std::string& path() const { return path_; }
  std::string Text() const { return ReadBytes(path_); }

  // The file of another process, refreshed so long ago.
  void Write(const std::function<void(HolderIdentity&)>& change, int age_s) const {
    HolderIdentity holder = HolderIdentity::OfThisProcess("weftd");
    change(holder);
    WriteBytes(path_, TextOf(holder));
    const timespec then = {time(nullptr) - age_s, 0};
    const timespec times[] = {then, then};
    ASSERT_EQ(utimensat(AT_FDCWD, path_.c_str(), times, 0), 0);
  }
  absl::Status Taken() const { return HolderRecord::Take(path_, "weft register").status(); }

  static std::string HostName() {
    const std::string host = HolderIdentity::OfThisProcess("").host;
    return host.substr(0, host.find(' '));
  }

  // A process that holds the file until it is killed.
  pid_t HolderBeside() const {
    int ready[2];
    EXPECT_EQ(pipe(ready), 0);
    const pid_t child = fork();
    if (child == 0) {
      const auto record = HolderRecord::Take(path_, "weftd");
      if (!record.ok() || write(ready[1], "x", 1) != 1) _exit(1);
      pause();
    }
    char byte = 0;
    EXPECT_EQ(read(ready[0], &byte, 1), 1);
    close(ready[0]);
    close(ready[1]);
    return child;
  }

  TempFolder folder_;
  const std::string path_ = folder_ / "state.holder";
};

TEST_F(HolderRecordTest, NamesTheProcessAndGoesAwayWithIt) {
  {
    const auto record = HolderRecord::Take(path(), "weftd");
    ASSERT_TRUE(record.ok()) << record.status();
    const absl::StatusOr<HolderIdentity> said = ParseHolder(Text());
    ASSERT_TRUE(said.ok());
    EXPECT_EQ(said->pid, getpid());
    EXPECT_GT(said->started, 0);
    EXPECT_EQ(said->owner, "weftd");
    EXPECT_FALSE(said->boot_id.empty());
    EXPECT_TRUE(record->IsHeld());
    const absl::Status second = Taken();
    EXPECT_EQ(second.code(), absl::StatusCode::kFailedPrecondition) << "also within a process";
    EXPECT_THAT(std::string(second.message()), HasSubstr("process " + std::to_string(getpid())));
  }
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

TEST_F(HolderRecordTest, IsAnotherProcessesAsLongAsThatLives) {
  const pid_t child = HolderBeside();
  EXPECT_EQ(Taken().code(), absl::StatusCode::kFailedPrecondition);
  kill(child, SIGSTOP);  // one that stands still lives
  EXPECT_EQ(Taken().code(), absl::StatusCode::kFailedPrecondition);
  kill(child, SIGKILL);
  while (!Taken().ok()) usleep(1000);  // nobody has taken note of its end yet
  waitpid(child, nullptr, 0);
  EXPECT_TRUE(Taken().ok());
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

TEST_F(HolderRecordTest, OfThisMachineCountsTheProcessAlone) {
  // Another process has the number by now.
  Write([](HolderIdentity& h) { h.pid = getppid(), h.started += 1; }, 0);
  EXPECT_TRUE(Taken().ok());
  // The machine booted since.
  Write([](HolderIdentity& h) { h.pid = getppid(), h.boot_id = "another"; }, 0);
  EXPECT_TRUE(Taken().ok() || HolderIdentity::OfThisProcess("").host.ends_with(' '));
  // This process, which holds nothing.
  Write([](HolderIdentity&) {}, 0);
  EXPECT_TRUE(Taken().ok());
}

TEST_F(HolderRecordTest, OfAnotherMachineCountsUntilItsRefreshesAreMissed) {
  const std::function<void(HolderIdentity&)> others[] = {
      [](HolderIdentity& h) { h.host = "farm-2 0123"; },
      [](HolderIdentity& h) { h.pid_namespace = "pid:[1]"; },  // a container of this one
  };
  for (const auto& other : others) {
    Write(other, 30);
    const absl::Status status = Taken();
    EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_THAT(std::string(status.message()),
                AllOf(HasSubstr("weftd, process"), HasSubstr("60 s"), HasSubstr("remove the file")));
    Write(other, -100);  // of a machine whose clock is ahead
    EXPECT_EQ(Taken().code(), absl::StatusCode::kFailedPrecondition);
    Write(other, 61);
    EXPECT_TRUE(Taken().ok());
  }
  // Damaged: somebody may hold it.
  WriteBytes(path(), "half");
  EXPECT_EQ(Taken().code(), absl::StatusCode::kFailedPrecondition);
}

TEST_F(HolderRecordTest, IsRefreshedUntilAnotherHasIt) {
  int lost = 0;
  auto record = HolderRecord::Take(path(), "weftd", [&lost] { ++lost; });
  ASSERT_TRUE(record.ok());
  const timespec long_ago[] = {{1000, 0}, {1000, 0}};
  utimensat(AT_FDCWD, path().c_str(), long_ago, 0);
  EXPECT_TRUE(record->Refresh());
  struct stat info;
  ASSERT_EQ(stat(path().c_str(), &info), 0);
  EXPECT_GT(info.st_mtime, 1000);
  // Removed, for example with its folder, which was made again.
  fs::remove(path());
  EXPECT_TRUE(record->Refresh());
  EXPECT_TRUE(fs::exists(path()));
  Write([](HolderIdentity& h) { h.host = "farm-2 0123"; }, 0);
  EXPECT_FALSE(record->Refresh());
  EXPECT_FALSE(record->Refresh());
  EXPECT_FALSE(record->IsHeld());
  EXPECT_EQ(lost, 1);
  record = absl::NotFoundError("let go");
  EXPECT_THAT(Text(), HasSubstr("farm-2")) << "not ours to remove";
}

// A program waits for its signals in threads of its own, or blocks none and is ended by them.
TEST_F(HolderRecordTest, TheThreadThatRefreshesTakesNoSignals) {
  const auto record = HolderRecord::Take(path(), "weftd");
  ASSERT_TRUE(record.ok());
  std::this_thread::sleep_for(std::chrono::milliseconds(50));  // threads block all signals while they start
  // Signal n is bit n - 1 of what a thread blocks.
  const uint64_t ends = 1 << (SIGHUP - 1) | 1 << (SIGINT - 1) | 1 << (SIGUSR1 - 1) | 1 << (SIGTERM - 1);
  int without = 0;
  for (const fs::directory_entry& task : fs::directory_iterator("/proc/self/task")) {
    const std::string status = ReadBytes(task.path() / "status");
    const size_t at = status.find("SigBlk:\t");
    ASSERT_NE(at, std::string::npos);
    without += (std::stoull(status.substr(at + 8, 16), nullptr, 16) & ends) == ends;
  }
  EXPECT_GE(without, 1);
  sigset_t mine;
  ASSERT_EQ(pthread_sigmask(SIG_BLOCK, nullptr, &mine), 0);
  EXPECT_EQ(sigismember(&mine, SIGTERM), 0) << "this thread still does";
}

// Of eight processes that find the file of a dead one, one gets it.
TEST_F(HolderRecordTest, OfADeadProcessGoesToOne) {
  for (int round = 0; round < 20; ++round) {
    Write([](HolderIdentity& h) { h.started += 1; }, 0);
    constexpr int kTakers = 8;
    pid_t takers[kTakers];
    int hold[2];
    ASSERT_EQ(pipe(hold), 0);
    for (pid_t& taker : takers) {
      taker = fork();
      if (taker != 0) continue;
      close(hold[1]);
      const auto record = HolderRecord::Take(path(), "weftd");
      char byte = 0;
      if (record.ok()) [[maybe_unused]]
        const ssize_t end = read(hold[0], &byte, 1);  // until all have tried
      _exit(record.ok() ? 0 : 1);
    }
    int winners = 0, losers = 0;
    for (int ended = 0; ended < kTakers - 1; ++ended) {
      int status = 0;
      ASSERT_GT(waitpid(-1, &status, 0), 0);
      ++(WEXITSTATUS(status) == 0 ? winners : losers);
    }
    EXPECT_EQ(losers, kTakers - 1) << "one still holds it";
    close(hold[1]);
    close(hold[0]);
    int status = 0;
    waitpid(-1, &status, 0);
    EXPECT_EQ(WEXITSTATUS(status), 0);
    fs::remove(path());
  }
}

// The file of a folder that has another name by then.
TEST_F(HolderRecordTest, InAFolderFollowsTheFolderAndSpeaksOfItsName) {
  fs::create_directory(folder_ / "state");
  const auto folder = ConfinedFolder::Open(folder_ / "state");
  ASSERT_TRUE(folder.ok()) << folder.status();
  auto record = HolderRecord::TakeIn(*folder, "holder", "weftd");
  ASSERT_TRUE(record.ok()) << record.status();
  EXPECT_TRUE(record->IsHeld());
  fs::rename(folder_ / "state", folder_ / "moved");
  EXPECT_TRUE(record->Refresh());
  EXPECT_EQ(ParseHolder(ReadBytes(folder_ / "moved/holder"))->owner, "weftd");
  const absl::Status second = HolderRecord::TakeIn(*folder, "holder", "weft register").status();
  EXPECT_EQ(second.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(second.message(), absl::StrCat(folder_ / "state/holder", ": is held by weftd, process ", getpid(),
                                           " on ", HostName(), "; wait until it has ended, or stop it"));
  // Another one takes its place, and lets go of its file.
  record = HolderRecord::TakeIn(*folder, "other", "weftd");
  ASSERT_TRUE(record.ok()) << record.status();
  EXPECT_FALSE(fs::exists(folder_ / "moved/holder"));
  EXPECT_TRUE(fs::exists(folder_ / "moved/other"));
  record = absl::NotFoundError("let go");
  EXPECT_TRUE(fs::is_empty(folder_ / "moved"));
}

TEST_F(HolderRecordTest, AnAssignedOneHoldsWhatTheOtherHeld) {
  auto first = HolderRecord::Take(path(), "weftd");
  auto second = HolderRecord::Take(folder_ / "other.holder", "weftd");
  ASSERT_TRUE(first.ok() && second.ok());
  *first = *std::move(second);
  second = absl::NotFoundError("let go");
  EXPECT_TRUE(first->IsHeld());
  EXPECT_TRUE(fs::exists(folder_ / "other.holder"));
  EXPECT_FALSE(fs::exists(path()));
}

TEST_F(HolderRecordTest, SaysWhyTheFileCannotBeMade) {
  const absl::Status status = HolderRecord::Take(folder_ / "none/state.holder", "weftd").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("none/state.holder"));
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

TEST(HolderIdentity, IsReadAsItIsWritten) {
  HolderIdentity holder = HolderIdentity::OfThisProcess("weft register\nowner nobody");
  const absl::StatusOr<HolderIdentity> read = ParseHolder(TextOf(holder));
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(read->host, holder.host);
  EXPECT_EQ(read->started, holder.started);
  EXPECT_EQ(read->owner, "weft register?owner nobody");
  for (const char* other : {"", "\n", "weft-holder 1\n", "weft-holder 2\nhost a"})
    EXPECT_FALSE(ParseHolder(other).ok()) << other;
  const std::string text = "weft-holder 1\nhost h 1\nboot b\nnamespace n\npid 12\nstarted 34\nowner o\n";
  ASSERT_TRUE(ParseHolder(text).ok());
  EXPECT_EQ(TextOf(*ParseHolder(text)), text);
  for (const char* key : {"host ", "boot ", "namespace ", "pid ", "started ", "owner "}) {
    std::string damaged = text;
    damaged[damaged.find(key)] = '-';
    EXPECT_TRUE(absl::IsInvalidArgument(ParseHolder(damaged).status())) << damaged;
  }
  for (const auto& [number, wrong] :
       {std::pair{"pid 12", "pid x"}, std::pair{"pid 12", "pid 0"}, std::pair{"started 34", "started x"}}) {
    std::string damaged = text;
    damaged.replace(damaged.find(number), std::string(number).size(), wrong);
    EXPECT_FALSE(ParseHolder(damaged).ok()) << damaged;
  }
}

}  // namespace
}  // namespace weft
