#include "services/work/pipeline/result_lock.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;
using ::testing::AllOf;
using ::testing::HasSubstr;

class ResultLockTest : public ::testing::Test {
 protected:
  ResultLockTest() { fs::create_directory(out_); }
  absl::StatusOr<ResultLock> Acquire(const std::string& owner = "a test") {
    return ResultLock::Acquire(out_, owner, milliseconds(0));
  }

  TempFolder folder_;
  const std::string out_ = folder_ / "out";
};

TEST_F(ResultLockTest, HasOneHolderWhoIsNamed) {
  {
    const auto first = Acquire("job 7 of weftd");
    ASSERT_TRUE(first.ok()) << first.status();
    const absl::Status second = Acquire().status();
    EXPECT_EQ(second.code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_THAT(second.message(), AllOf(HasSubstr(out_), HasSubstr("job 7 of weftd, process "),
                                        HasSubstr(std::to_string(getpid())), HasSubstr("wait until")));
  }
  EXPECT_TRUE(fs::is_empty(out_));
  EXPECT_TRUE(Acquire().ok());
}

TEST_F(ResultLockTest, DeathLetsGo) {
  int told[2];
  ASSERT_EQ(pipe(told), 0);
  const pid_t child = fork();
  if (child == 0) {
    const auto lock = Acquire("the child");
    [[maybe_unused]] const ssize_t n = write(told[1], lock.ok() ? "1" : "0", 1);
    for (;;) pause();
  }
  char held = 0;
  ASSERT_EQ(read(told[0], &held, 1), 1);
  EXPECT_EQ(held, '1');
  EXPECT_THAT(Acquire().status().message(), HasSubstr("the child"));
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  EXPECT_TRUE(fs::exists(out_ + "/" + ResultLock::kFileName));
  EXPECT_TRUE(Acquire().ok());
}

TEST_F(ResultLockTest, IsTakenAnewWhenItsFolderWasRemoved) {
  auto lock = Acquire();
  ASSERT_TRUE(lock.ok());
  ASSERT_TRUE(lock->Renew().ok());
  fs::remove_all(out_);
  ASSERT_TRUE(lock->Renew().ok());
  EXPECT_FALSE(Acquire().ok());
}

TEST_F(ResultLockTest, IsLostWhenAnotherTookTheRemovedFolder) {
  auto lock = Acquire("the first");
  ASSERT_TRUE(lock.ok());
  fs::remove_all(out_);
  fs::create_directories(out_);
  {
    const auto other = Acquire("the other");
    ASSERT_TRUE(other.ok());
    EXPECT_THAT(lock->Renew().message(), HasSubstr("the other"));
  }
  EXPECT_TRUE(lock->Renew().ok());
}

TEST_F(ResultLockTest, DoesNotFollowALink) {
  WriteBytes(folder_ / "elsewhere", "kept");
  fs::create_symlink(folder_ / "elsewhere", out_ + "/" + ResultLock::kFileName);
  EXPECT_FALSE(Acquire().ok());
  EXPECT_EQ(ReadBytes(folder_ / "elsewhere"), "kept");
}

// A lock file that somebody else holds, with these words in it.
class ForeignLock {
 public:
  ForeignLock(const std::string& out, const std::string& words) {
    const std::string path = out + "/" + ResultLock::kFileName;
    WriteBytes(path, words);
    fd_ = open(path.c_str(), O_RDONLY);
    EXPECT_EQ(flock(fd_, LOCK_EX | LOCK_NB), 0);
  }
  ~ForeignLock() { close(fd_); }

 private:
  int fd_ = -1;
};

TEST_F(ResultLockTest, WordsOfAnotherHolderAreOnePlainLine) {
  for (const auto& [words, told] : {std::pair("weft\x07 register\nmore\n", "weft? register"),
                                    {"", "another process"},
                                    {"\n", "another process"}}) {
    const ForeignLock other(out_, words);
    EXPECT_EQ(Acquire().status().message(), out_ + ": " + told +
                                                ", writes to this folder; wait until it has ended, or choose "
                                                "another folder");
  }
}

TEST_F(ResultLockTest, WaitsForAsLongAsItHasPatience) {
  auto first = Acquire();
  ASSERT_TRUE(first.ok());
  std::optional<ResultLock> held(*std::move(first));
  const auto began = std::chrono::steady_clock::now();
  EXPECT_FALSE(ResultLock::Acquire(out_, "a test", milliseconds(100)).ok());
  EXPECT_GE(std::chrono::steady_clock::now() - began, milliseconds(100));
  std::jthread later([&] {
    std::this_thread::sleep_for(milliseconds(60));
    held.reset();
  });
  EXPECT_TRUE(ResultLock::Acquire(out_, "a test", milliseconds(20'000)).ok());
}

TEST_F(ResultLockTest, SaysWhoHoldsIt) {
  const auto lock = Acquire("weft register");
  ASSERT_TRUE(lock.ok());
  char host[256] = "";
  gethostname(host, sizeof(host) - 1);
  EXPECT_EQ(ReadBytes(out_ + "/" + ResultLock::kFileName),
            "weft register, process " + std::to_string(getpid()) + " on " + host + "\n");
  EXPECT_TRUE(fs::exists(out_ + "/" + ResultLock::kHolderName));
}

TEST_F(ResultLockTest, NeedsAFolder) {
  EXPECT_EQ(ResultLock::Acquire(out_ + "/none", "a test", milliseconds(0)).status().code(),
            absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace weft
