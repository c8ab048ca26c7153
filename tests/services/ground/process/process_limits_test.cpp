#include "services/ground/process/process_limits.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <string>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

TEST(DescriptorLimit, IsRaisedToTheHardOne) {
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  rlimit low = before;
  low.rlim_cur = 100;
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &low), 0);
  EXPECT_EQ(DescriptorLimit(), 100);
  EXPECT_EQ(static_cast<rlim_t>(RaiseDescriptorLimit()), before.rlim_max);
  EXPECT_EQ(static_cast<rlim_t>(DescriptorLimit()), before.rlim_max);
  setrlimit(RLIMIT_NOFILE, &before);
}

// Sanitizers reserve more than any limit.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
// 0 where the limit is so many MiB after LimitMemory.
int LimitAfter(int64_t asked_mib, rlim_t expected_mib) {
  rlimit limit = {};
  if (!LimitMemory(asked_mib).ok() || getrlimit(RLIMIT_DATA, &limit) != 0) return 2;
  const rlim_t expected = expected_mib << 20;
  return limit.rlim_cur == expected && limit.rlim_max == expected ? 0 : 1;
}

TEST(MemoryLimit, HoldsAndOnlyEverFalls) {
  EXPECT_EXIT(_exit(LimitAfter(4096, 4096)), ::testing::ExitedWithCode(0), "");
  EXPECT_EXIT(_exit(LimitAfter(4096, 4096) + LimitAfter(2048, 2048) + LimitAfter(3000, 2048)),
              ::testing::ExitedWithCode(0), "");
}
#endif

TEST(MemoryLimit, IsNoneForZero) {
  rlimit before = {}, after = {};
  ASSERT_EQ(getrlimit(RLIMIT_DATA, &before), 0);
  EXPECT_TRUE(LimitMemory(0).ok());
  EXPECT_TRUE(LimitMemory(-1).ok());
  ASSERT_EQ(getrlimit(RLIMIT_DATA, &after), 0);
  EXPECT_EQ(after.rlim_cur, before.rlim_cur);
}

// 0 where a write beyond a limit of 10 bytes fails with EFBIG.
int WriteBeyondTenBytes(const std::string& path) {
  const rlimit limit = {10, 10};
  const int fd = open(path.c_str(), O_WRONLY | O_CREAT, 0600);
  if (fd < 0 || setrlimit(RLIMIT_FSIZE, &limit) != 0 || write(fd, "0123456789", 10) != 10) return 2;
  return write(fd, "x", 1) < 0 && errno == EFBIG ? 0 : 1;
}

TEST(FileSizeLimit, EndsAProcessUnlessItIsToFail) {
  const TempFolder folder;
  EXPECT_EXIT(
      {
        signal(SIGXFSZ, SIG_DFL);  // whatever started the test may ignore it
        _exit(WriteBeyondTenBytes(folder / "a"));
      },
      ::testing::KilledBySignal(SIGXFSZ), "");
  EXPECT_EXIT(
      {
        FailBeyondFileSize();
        _exit(WriteBeyondTenBytes(folder / "b"));
      },
      ::testing::ExitedWithCode(0), "");
  EXPECT_EQ(ReadBytes(folder / "b"), "0123456789");
}

}  // namespace
}  // namespace weft
